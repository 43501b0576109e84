//! What stands on a plan: sources, the listener's head, labels, the scale.

use glam::{Vec2, Vec3, vec2};

use crate::axis::{round_step, tick_text};
use crate::canvas::Canvas;
use crate::colormap::Colour;
use crate::floor_plan::PlanFrame;
use crate::lettering::{Align, Font};
use foresound::scene::ListenerPose;

const SOURCE_COLOUR: Colour = Colour(255, 196, 0);
pub(super) const SOURCE_RADIUS_PX: f32 = 7.0;
const LISTENER_RADIUS_PX: f32 = 8.0;

pub(super) fn draw_source(canvas: &mut Canvas, at: Vec2) {
    canvas.fill_circle(at, SOURCE_RADIUS_PX + 1.0, Colour::WHITE);
    canvas.fill_circle(at, SOURCE_RADIUS_PX, Colour::INK);
    canvas.fill_circle(at, SOURCE_RADIUS_PX - 1.8, SOURCE_COLOUR);
}

pub(super) fn draw_listener(canvas: &mut Canvas, frame: &PlanFrame, listener: &ListenerPose) {
    let ahead = listener.orientation * Vec3::NEG_Z;
    let at = frame.place(listener.position);
    draw_head(canvas, at, vec2(ahead.x, ahead.z).normalize_or(Vec2::NEG_Y));
}

/// A head with a nose.
pub(super) fn draw_head(canvas: &mut Canvas, at: Vec2, ahead: Vec2) {
    for (grow, colour) in [(2.0, Colour::WHITE), (0.0, Colour::INK)] {
        let radius = LISTENER_RADIUS_PX + grow;
        let side = ahead.perp() * radius * 0.8;
        let nose = at + ahead * (LISTENER_RADIUS_PX * 1.9 + grow);
        let cheek = ahead * radius * 0.6;
        canvas.fill_polygon(&[nose, at + cheek + side, at + cheek - side], colour, 1.0);
        canvas.fill_circle(at, radius, colour);
    }
}

/// The centre of a label beside a mark: the first of eight places that is free and within the plan.
pub(super) fn label_place(mark: Vec2, half: Vec2, frame: &PlanFrame, taken: &[[Vec2; 2]]) -> Vec2 {
    let (dx, dy) = (
        half.x + SOURCE_RADIUS_PX + 5.0,
        half.y + SOURCE_RADIUS_PX + 4.0,
    );
    let places = [
        (dx, 0.0),
        (-dx, 0.0),
        (0.0, -dy),
        (0.0, dy),
        (dx, -dy),
        (-dx, -dy),
        (dx, dy),
        (-dx, dy),
    ];
    let [low, high] = [frame.corner_px, frame.corner_px + frame.size_px];
    let is_free = |centre: &Vec2| {
        let (from, to) = (*centre - half, *centre + half);
        let within = from.cmpge(low).all() && to.cmple(high).all();
        within
            && !taken
                .iter()
                .any(|[a, b]| from.cmplt(*b).all() && to.cmpgt(*a).all())
    };
    let mut places = places.into_iter().map(|(x, y)| mark + vec2(x, y));
    let first = mark + vec2(dx, 0.0);
    places.find(is_free).unwrap_or(first)
}

/// A bar of a round length, its right end at a point.
pub(super) fn draw_scale_bar(canvas: &mut Canvas, right: Vec2, px_per_m: f32) {
    let length_m = round_step(f64::from(140.0 / px_per_m), 1);
    // The step is the next round one above; the bar stays below twice the room.
    let length_m = if length_m as f32 * px_per_m > 220.0 {
        length_m / 2.0
    } else {
        length_m
    };
    let text = format!("{} m", tick_text(length_m, length_m));
    let width = Font::Label.width_px(&text);
    let end = right - vec2(width + 10.0, 0.0);
    let start = end - vec2(length_m as f32 * px_per_m, 0.0);
    canvas.fill_rect(
        start - vec2(0.0, 1.0),
        end + vec2(0.0, 1.0),
        Colour::INK,
        1.0,
    );
    for at in [start, end] {
        canvas.fill_rect(at - vec2(1.0, 6.0), at + vec2(1.0, 6.0), Colour::INK, 1.0);
    }
    canvas.text(right, Align::Right, Font::Label, Colour::TEXT, &text);
}
