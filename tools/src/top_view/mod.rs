//! A picture of a scene from above: plan, sources, listener, walk and the paths found.

mod marks;

use glam::{Vec2, Vec3, vec2};

use self::marks::{
    SOURCE_RADIUS_PX, draw_head, draw_listener, draw_scale_bar, draw_source, label_place,
};
use super::canvas::Canvas;
use super::colormap::Colour;
use super::floor_plan::{PlanFrame, draw_plan};
use super::lettering::{Align, Font};
use foresound::propagation::{MAX_ORDER, PathSet};
use foresound::scene::{ListenerPose, TriangleMesh};
use foresound::{Error, Result};

/// Largest width and height of the plan, in pixels.
const PLAN_PX: Vec2 = Vec2::new(1320.0, 900.0);
/// White around the plan, in pixels, and room for the title above it.
const MARGIN_PX: f32 = 40.0;
const HEAD_PX: f32 = 84.0;
/// Least width of the picture, in pixels: the legend needs it.
const LEAST_WIDTH_PX: f32 = 1000.0;
/// Height of a line of the legend, in pixels.
const LEGEND_LINE_PX: f32 = 30.0;
/// The cut above the listener's ears, in metres: below the head of a door, above whatever one looks over.
const CUT_ABOVE_EARS_M: f32 = 0.3;

/// Kinds of paths that are drawn and counted apart: by order, and last those that bend, whatever reflects them besides.
const KINDS: usize = MAX_ORDER + 2;
const BENT: usize = KINDS - 1;

/// Colour, width in pixels and opacity of a path by its kind.
const STYLES: [(Colour, f32, f32); KINDS] = [
    (Colour(208, 26, 48), 2.6, 1.0),
    (Colour(232, 120, 16), 1.8, 0.85),
    (Colour(20, 142, 96), 1.4, 0.7),
    (Colour(36, 104, 196), 1.2, 0.55),
    (Colour(128, 72, 172), 1.1, 0.45),
    (Colour(214, 60, 158), 1.2, 0.7),
];
/// Paths of one kind that are drawn at full opacity; more are drawn paler.
const CLEAR_PATHS: f32 = 40.0;

/// One path as a line.
#[derive(Debug, Clone, PartialEq)]
pub struct PathLine {
    /// Source, reflection points and bends, listener, in metres.
    pub points: Vec<Vec3>,
    /// Number of reflections.
    pub order: u8,
    /// Number of edges that it bends around.
    pub diffraction_order: u8,
}

impl PathLine {
    fn kind(&self) -> usize {
        if self.diffraction_order > 0 {
            BENT
        } else {
            usize::from(self.order)
        }
    }
}

/// The paths of an update as lines. A path of a source that the set does not list is left out.
pub fn path_lines(set: &PathSet) -> Vec<PathLine> {
    let line = |path: &foresound::propagation::Path| {
        let source = set.sources.iter().find(|s| s.id == path.source)?;
        let mut points = vec![source.position];
        points.extend_from_slice(path.points());
        points.push(set.listener.position);
        Some(PathLine {
            points,
            order: path.order,
            diffraction_order: path.diffraction_order,
        })
    };
    set.paths.iter().filter_map(line).collect()
}

/// The corners of a mesh's triangles; a triangle that names a missing vertex is left out.
pub fn mesh_triangles(mesh: &TriangleMesh) -> Vec<[Vec3; 3]> {
    let corner = |i: u32| mesh.vertices.get(i as usize).copied();
    let triangles = mesh.triangles.iter();
    triangles
        .filter_map(|&[a, b, c]| Some([corner(a)?, corner(b)?, corner(c)?]))
        .collect()
}

/// What the picture shows. World coordinates in metres, +y up; +x is to the right, +z down the picture.
#[derive(Default)]
pub struct TopView<'a> {
    /// Title of the whole.
    pub title: &'a str,
    /// One line below the title.
    pub caption: &'a str,
    /// The scene.
    pub triangles: &'a [[Vec3; 3]],
    /// Sources with their labels; an empty label is not written.
    pub sources: &'a [(Vec3, String)],
    /// Ends of the listener's walk.
    pub walk: Option<[Vec3; 2]>,
    /// The listener.
    pub listener: Option<ListenerPose>,
    /// Paths, in any order.
    pub paths: &'a [PathLine],
    /// Height in metres at which the scene is cut open at the listener's place; elsewhere the cut is as high above
    /// the ground. If none is given, 0.3 m above the listener's ears, or no cut without a listener.
    pub cut_height_m: Option<f32>,
}

impl TopView<'_> {
    /// Draws the picture, 1400 pixels wide unless the scene is much deeper than wide.
    ///
    /// # Errors
    /// [`Error::Setting`] if there is nothing to draw.
    pub fn draw(&self) -> Result<Canvas> {
        let frame = self.frame()?;
        let width = (frame.size_px.x + 2.0 * MARGIN_PX).max(LEAST_WIDTH_PX);
        let lines = if self.paths.is_empty() { 2.0 } else { 3.0 };
        let foot = frame.corner_px.y + frame.size_px.y + 16.0;
        let height = foot + lines * LEGEND_LINE_PX + 12.0;
        let mut canvas = Canvas::new(width as usize, height as usize)?;
        let room = width - 2.0 * MARGIN_PX;
        let title = Font::Title.fitted(self.title, room);
        canvas.text(
            vec2(MARGIN_PX, 30.0),
            Align::Left,
            Font::Title,
            Colour::INK,
            &title,
        );
        let caption = Font::Label.fitted(self.caption, room);
        canvas.text(
            vec2(MARGIN_PX, 58.0),
            Align::Left,
            Font::Label,
            Colour::TEXT,
            &caption,
        );

        draw_plan(&mut canvas, &frame, self.triangles, self.cut());
        self.draw_paths(&mut canvas, &frame);
        self.draw_walk(&mut canvas, &frame);
        self.draw_sources(&mut canvas, &frame);
        if let Some(listener) = &self.listener {
            draw_listener(&mut canvas, &frame, listener);
        }
        canvas.frame(
            frame.corner_px - 1.0,
            frame.corner_px + frame.size_px + 1.0,
            Colour::AXIS,
        );
        self.draw_legend(&mut canvas, &frame, foot);
        Ok(canvas)
    }

    fn cut(&self) -> Option<(Vec3, f32)> {
        let place = self
            .listener
            .map(|l| l.position)
            .or(self.walk.map(|w| w[0]));
        match (place, self.cut_height_m) {
            (Some(place), Some(height_m)) => Some((place, height_m)),
            (Some(place), None) => Some((place, place.y + CUT_ABOVE_EARS_M)),
            (None, Some(height_m)) => Some((self.sources.first()?.0, height_m)),
            (None, None) => None,
        }
    }

    /// The largest frame that holds everything.
    fn frame(&self) -> Result<PlanFrame> {
        let marks = self.sources.iter().map(|s| s.0);
        let marks = marks
            .chain(self.walk.into_iter().flatten())
            .chain(self.listener.map(|l| l.position));
        let places = self.triangles.iter().flatten().copied().chain(marks);
        let flat = places.map(|p| vec2(p.x, p.z)).filter(|p| p.is_finite());
        let bounds = flat
            .map(|p| (p, p))
            .reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
        let Some((low, high)) = bounds else {
            return Err(Error::setting(
                "top view",
                "nothing to draw",
                "give a scene with triangles",
            ));
        };
        // A hair of floor around, and at least a metre.
        let border = ((high - low) * 0.02).max(Vec2::splat(0.5));
        let (low, high) = (low - border, high + border);
        let size_m = high - low;
        let px_per_m = (PLAN_PX / size_m).min_element();
        let size_px = (size_m * px_per_m).ceil().clamp(Vec2::splat(40.0), PLAN_PX);
        let width = (size_px.x + 2.0 * MARGIN_PX).max(LEAST_WIDTH_PX);
        Ok(PlanFrame {
            corner_m: low,
            corner_px: vec2(((width - size_px.x) / 2.0).floor(), HEAD_PX),
            size_px,
            px_per_m,
        })
    }

    fn count(&self, kind: usize) -> usize {
        self.paths.iter().filter(|p| p.kind() == kind).count()
    }

    fn draw_paths(&self, canvas: &mut Canvas, frame: &PlanFrame) {
        for (kind, (colour, width_px, opacity)) in STYLES.into_iter().enumerate().rev() {
            let crowd = (CLEAR_PATHS / self.count(kind).max(1) as f32)
                .sqrt()
                .clamp(0.15, 1.0);
            for path in self.paths.iter().filter(|p| p.kind() == kind) {
                let points: Vec<Vec2> = path.points.iter().map(|&p| frame.place(p)).collect();
                canvas.polyline(&points, width_px, colour, opacity * crowd);
            }
        }
    }

    fn draw_walk(&self, canvas: &mut Canvas, frame: &PlanFrame) {
        let Some(ends) = self.walk else {
            return;
        };
        let [from, to] = ends.map(|e| frame.place(e));
        canvas.line(from, to, 5.0, Colour::WHITE, 0.8);
        canvas.dashed_line(from, to, 2.4, [10.0, 7.0], Colour::INK);
        let across = (to - from).normalize_or_zero().perp() * 8.0;
        for end in [from, to] {
            canvas.line(end - across, end + across, 2.4, Colour::INK, 1.0);
        }
    }

    fn draw_sources(&self, canvas: &mut Canvas, frame: &PlanFrame) {
        let marks: Vec<Vec2> = self.sources.iter().map(|s| frame.place(s.0)).collect();
        let mut taken: Vec<[Vec2; 2]> = marks
            .iter()
            .map(|&m| [m - SOURCE_RADIUS_PX - 2.0, m + SOURCE_RADIUS_PX + 2.0])
            .collect();
        taken.extend(
            self.listener
                .map(|l| frame.place(l.position))
                .map(|l| [l - 18.0, l + 18.0]),
        );
        let ends = self.walk.into_iter().flatten().map(|e| frame.place(e));
        taken.extend(ends.map(|e| [e - 9.0, e + 9.0]));
        marks.iter().for_each(|&mark| draw_source(canvas, mark));
        for (mark, (_, label)) in marks.iter().zip(self.sources) {
            if label.is_empty() {
                continue;
            }
            let half = vec2(Font::Bold.width_px(label), Font::Bold.height_px()) / 2.0;
            let centre = label_place(*mark, half, frame, &taken);
            taken.push([centre - half, centre + half]);
            canvas.text_on_ground(centre, Align::Centre, Font::Bold, Colour::INK, label);
        }
    }

    fn draw_legend(&self, canvas: &mut Canvas, frame: &PlanFrame, foot: f32) {
        let mut y = foot + LEGEND_LINE_PX / 2.0;
        let label = |canvas: &mut Canvas, x: f32, y: f32, text: &str| -> f32 {
            canvas.text(vec2(x, y), Align::Left, Font::Label, Colour::TEXT, text);
            x + Font::Label.width_px(text) + 26.0
        };
        if !self.paths.is_empty() {
            let mut x = MARGIN_PX;
            for (kind, (colour, width_px, _)) in STYLES.into_iter().enumerate() {
                canvas.line(vec2(x, y), vec2(x + 30.0, y), width_px + 1.0, colour, 1.0);
                let name = match kind {
                    0 => "direct".into(),
                    BENT => "bent".into(),
                    order => format!("order {order}"),
                };
                let text = format!("{name} ({})", self.count(kind));
                x = label(canvas, x + 40.0, y, &text);
            }
            y += LEGEND_LINE_PX;
        }
        let mut x = MARGIN_PX;
        if !self.sources.is_empty() {
            draw_source(canvas, vec2(x + 15.0, y));
            x = label(canvas, x + 40.0, y, "source");
        }
        if self.listener.is_some() {
            draw_head(canvas, vec2(x + 11.0, y), Vec2::X);
            x = label(canvas, x + 40.0, y, "listener");
        }
        if self.walk.is_some() {
            canvas.dashed_line(vec2(x, y), vec2(x + 30.0, y), 2.4, [10.0, 7.0], Colour::INK);
            label(canvas, x + 40.0, y, "walk");
        }
        let right = canvas.width() as f32 - MARGIN_PX;
        draw_scale_bar(canvas, vec2(right, y), frame.px_per_m);
        let note = match self.cut() {
            Some((place, height_m)) => format!(
                "seen from above, x to the right, z downwards; cut open at y = {height_m:.1} m at the listener (x {:.1}, z {:.1})",
                place.x, place.z
            ),
            None => "seen from above, x to the right, z downwards".into(),
        };
        let note = Font::Small.fitted(&note, right - MARGIN_PX);
        let at = vec2(MARGIN_PX, y + LEGEND_LINE_PX);
        canvas.text(at, Align::Left, Font::Small, Colour::TEXT, &note);
    }
}

#[cfg(test)]
mod tests;
