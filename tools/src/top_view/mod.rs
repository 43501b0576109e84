//! A picture of a scene from above: plan, sources, listener, walk and paths.

mod marks;

use glam::{Vec2, Vec3, vec2};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use self::marks::{
    SOURCE_RADIUS, draw_head, draw_label, draw_listener, draw_scale_bar, draw_source, draw_walk,
    label_centre, point,
};
use super::chart::{
    AXIS, Area, Drawn, FINENESS, INK, LABEL, Picture, SMALL, TEXT, draw_title, legend, px,
    text_style,
};
use super::floor_plan::draw_plan;
use super::plan_ground::PlanFrame;
use foresound::propagation::{MAX_ORDER, PathSet};
use foresound::scene::ListenerPose;
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
/// The cut above the listener's ears, in metres: below a door's lintel, above furniture of eye height.
const CUT_ABOVE_EARS_M: f32 = 0.3;

/// Kinds of paths: by reflection order, and last all diffracted ones.
const KINDS: usize = MAX_ORDER + 2;
const DIFFRACTED: usize = KINDS - 1;

/// Colour, width in pixels and opacity of a path by its kind.
const STYLES: [(RGBColor, f32, f64); KINDS] = [
    (RGBColor(208, 26, 48), 2.6, 1.0),
    (RGBColor(232, 120, 16), 1.8, 0.85),
    (RGBColor(20, 142, 96), 1.4, 0.7),
    (RGBColor(36, 104, 196), 1.2, 0.55),
    (RGBColor(128, 72, 172), 1.1, 0.45),
    (RGBColor(214, 60, 158), 1.2, 0.7),
];
/// Paths of one kind that are drawn at full opacity; more are drawn paler.
const CLEAR_PATHS: f64 = 40.0;

/// One path as a line.
#[derive(Debug, Clone, PartialEq)]
pub struct PathLine {
    /// Source, reflection and diffraction points, listener, in metres.
    pub points: Vec<Vec3>,
    /// Number of reflections.
    pub order: u8,
    /// Number of diffracting edges.
    pub diffraction_order: u8,
}

impl PathLine {
    fn kind(&self) -> usize {
        if self.diffraction_order > 0 {
            DIFFRACTED
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

/// Content of the picture. World coordinates in metres, +y up; +x is to the right, +z down the picture.
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
    /// Height in metres at which the scene is cut open at the listener; elsewhere the cut is as high above the
    /// ground. The default is 0.3 m above the listener's ears, or no cut without a listener.
    pub cut_height_m: Option<f32>,
}

impl TopView<'_> {
    /// Draws the picture, 1400 pixels wide unless the scene is much deeper than wide.
    ///
    /// # Errors
    /// [`Error::Setting`] if the scene is empty.
    pub fn draw(&self) -> Result<Picture> {
        let plan = self.plan()?;
        let lines = if self.paths.is_empty() { 2.0 } else { 3.0 };
        let size = plan.size_px / FINENESS as f32;
        let width = (size.x + 2.0 * MARGIN_PX).max(LEAST_WIDTH_PX);
        let height = HEAD_PX + size.y + lines * LEGEND_LINE_PX + 28.0;
        Picture::draw(width as usize, height as usize, |area| {
            draw_title(area, px(MARGIN_PX), self.title, self.caption)?;
            draw_plan(area, &plan, self.triangles, self.cut())?;
            self.draw_paths(area, &plan)?;
            if let Some(ends) = self.walk {
                let ends @ [from, to] = ends.map(|end| plan.pixel(end));
                draw_walk(area, ends)?;
                let across = (to - from).normalize_or_zero().perp() * 16.0;
                for end in ends {
                    draw_walk(area, [end - across, end + across])?;
                }
            }
            self.draw_sources(area, &plan)?;
            if let Some(listener) = &self.listener {
                draw_listener(area, &plan, listener)?;
            }
            let corners = [plan.corner_px - 2.0, plan.corner_px + plan.size_px + 2.0];
            area.draw(&Rectangle::new(corners.map(point), AXIS.stroke_width(2)))?;
            self.draw_legend(area, &plan)
        })
    }

    fn cut(&self) -> Option<(Vec3, f32)> {
        let listener = self.listener.map(|l| l.position);
        let ears = listener.or(self.walk.map(|walk| walk[0]));
        match (ears, self.cut_height_m) {
            (Some(at), height_m) => Some((at, height_m.unwrap_or(at.y + CUT_ABOVE_EARS_M))),
            (None, Some(height_m)) => Some((self.sources.first()?.0, height_m)),
            (None, None) => None,
        }
    }

    /// The largest plan with all content.
    fn plan(&self) -> Result<PlanFrame> {
        let marks = self.sources.iter().map(|s| s.0);
        let marks = marks
            .chain(self.walk.into_iter().flatten())
            .chain(self.listener.map(|l| l.position));
        let points = self.triangles.iter().flatten().copied().chain(marks);
        let flat = points.map(|p| vec2(p.x, p.z)).filter(|p| p.is_finite());
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
        // A small margin of floor around, and at least a metre.
        let border = ((high - low) * 0.02).max(Vec2::splat(0.5));
        let (low, high) = (low - border, high + border);
        let size_m = high - low;
        let px_per_m = (PLAN_PX / size_m).min_element();
        let size_px = (size_m * px_per_m).ceil().clamp(Vec2::splat(40.0), PLAN_PX);
        let width = (size_px.x + 2.0 * MARGIN_PX).max(LEAST_WIDTH_PX);
        Ok(PlanFrame {
            corner_m: low,
            corner_px: vec2(((width - size_px.x) / 2.0).floor(), HEAD_PX) * FINENESS as f32,
            size_px: size_px * FINENESS as f32,
            px_per_m: px_per_m * FINENESS as f32,
        })
    }

    fn count(&self, kind: usize) -> usize {
        self.paths.iter().filter(|p| p.kind() == kind).count()
    }

    fn draw_paths(&self, area: &Area<'_>, plan: &PlanFrame) -> Drawn {
        for (kind, (colour, width_px, opacity)) in STYLES.into_iter().enumerate().rev() {
            let crowd = (CLEAR_PATHS / self.count(kind).max(1) as f64)
                .sqrt()
                .clamp(0.15, 1.0);
            let style = colour
                .mix(opacity * crowd)
                .stroke_width(px(width_px) as u32);
            for path in self.paths.iter().filter(|p| p.kind() == kind) {
                for ends in path.points.windows(2) {
                    let ends = [ends[0], ends[1]].map(|end| point(plan.pixel(end)));
                    area.draw(&PathElement::new(ends, style))?;
                }
            }
        }
        Ok(())
    }

    fn draw_sources(&self, area: &Area<'_>, plan: &PlanFrame) -> Drawn {
        let marks: Vec<Vec2> = self.sources.iter().map(|s| plan.pixel(s.0)).collect();
        let around = |at: Vec2, radius: f32| [at - radius, at + radius];
        let mut taken: Vec<[Vec2; 2]> = marks
            .iter()
            .map(|&m| around(m, SOURCE_RADIUS + 4.0))
            .collect();
        let listener = self.listener.map(|l| plan.pixel(l.position));
        taken.extend(listener.map(|l| around(l, 36.0)));
        let ends = self.walk.into_iter().flatten().map(|e| plan.pixel(e));
        taken.extend(ends.map(|e| around(e, 18.0)));
        for &mark in &marks {
            draw_source(area, mark)?;
        }
        for (mark, (_, label)) in marks.iter().zip(self.sources) {
            if label.is_empty() {
                continue;
            }
            let (width, height) =
                area.estimate_text_size(label, &text_style(LABEL, INK, HPos::Center))?;
            let half = vec2(width as f32, height as f32) / 2.0;
            let centre = label_centre(*mark, half, plan, &taken);
            taken.push([centre - half, centre + half]);
            draw_label(area, centre, label)?;
        }
        Ok(())
    }

    fn draw_legend(&self, area: &Area<'_>, plan: &PlanFrame) -> Drawn {
        let line = LEGEND_LINE_PX * FINENESS as f32;
        let margin = px(MARGIN_PX) as f32;
        let mut at = vec2(
            margin,
            plan.corner_px.y + plan.size_px.y + 16.0 * FINENESS as f32 + 0.5 * line,
        );
        if !self.paths.is_empty() {
            let entry = |(kind, style): (usize, (RGBColor, f32, f64))| {
                let name = match kind {
                    0 => "direct".into(),
                    DIFFRACTED => "diffracted".into(),
                    order => format!("order {order}"),
                };
                (format!("{name} ({})", self.count(kind)), style.0)
            };
            let entries: Vec<_> = STYLES.into_iter().enumerate().map(entry).collect();
            legend(area, point(at), &entries)?;
            at.y += line;
        }
        let step = vec2(px(40.0) as f32, 0.0);
        let label = |at: &mut Vec2, text: &str| -> Drawn {
            let style = text_style(LABEL, TEXT, HPos::Left);
            *at += step;
            area.draw(&Text::new(text, point(*at), style.clone()))?;
            at.x += area.estimate_text_size(text, &style)?.0 as f32 + px(26.0) as f32;
            Ok(())
        };
        if !self.sources.is_empty() {
            draw_source(area, at + 0.5 * step)?;
            label(&mut at, "source")?;
        }
        if self.listener.is_some() {
            draw_head(area, at + 0.3 * step, Vec2::X)?;
            label(&mut at, "listener")?;
        }
        if self.walk.is_some() {
            draw_walk(area, [at, at + 0.75 * step])?;
            label(&mut at, "walk")?;
        }
        let right = vec2(area.dim_in_pixel().0 as f32 - margin, at.y);
        draw_scale_bar(area, right, plan.px_per_m)?;
        let mut note = "seen from above, x to the right, z downwards".to_owned();
        if let Some((at, height_m)) = self.cut() {
            note += &format!(
                "; cut at y = {height_m:.1} m at the listener (x {:.1}, z {:.1})",
                at.x, at.z
            );
        }
        let style = text_style(SMALL, TEXT, HPos::Left);
        area.draw(&Text::new(note, point(vec2(margin, at.y + line)), style))
    }
}

#[cfg(test)]
mod tests;
