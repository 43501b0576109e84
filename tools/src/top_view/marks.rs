//! Marks on a plan: sources, the listener, labels, the scale. All lengths and positions are fine pixels.

use glam::{Vec2, Vec3, vec2};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::chart::{Area, Drawn, INK, LABEL, TEXT, bold_style, px, text_style};
use crate::plan_ground::PlanFrame;
use foresound::scene::ListenerPose;

const SOURCE_COLOUR: RGBColor = RGBColor(255, 196, 0);
pub(super) const SOURCE_RADIUS: f32 = 14.0;
const LISTENER_RADIUS: f32 = 16.0;

/// A position for `plotters`.
pub(super) fn point(at: Vec2) -> (i32, i32) {
    at.round().as_ivec2().into()
}

pub(super) fn draw_source(area: &Area<'_>, at: Vec2) -> Drawn {
    for (grow, colour) in [(2.0, WHITE), (0.0, INK), (-3.6, SOURCE_COLOUR)] {
        let radius = (SOURCE_RADIUS + grow).round() as i32;
        area.draw(&Circle::new(point(at), radius, colour.filled()))?;
    }
    Ok(())
}

pub(super) fn draw_listener(area: &Area<'_>, frame: &PlanFrame, listener: &ListenerPose) -> Drawn {
    let ahead = listener.orientation * Vec3::NEG_Z;
    let ahead = vec2(ahead.x, ahead.z).normalize_or(Vec2::NEG_Y);
    draw_head(area, frame.pixel(listener.position), ahead)
}

/// The listener: a head with a nose.
pub(super) fn draw_head(area: &Area<'_>, at: Vec2, ahead: Vec2) -> Drawn {
    for (grow, colour) in [(4.0, WHITE), (0.0, INK)] {
        let radius = LISTENER_RADIUS + grow;
        let side = ahead.perp() * radius * 0.8;
        let nose = at + ahead * (LISTENER_RADIUS * 1.9 + grow);
        let cheek = ahead * radius * 0.6;
        let corners = [nose, at + cheek + side, at + cheek - side].map(point);
        area.draw(&Polygon::new(corners, colour.filled()))?;
        area.draw(&Circle::new(point(at), radius as i32, colour.filled()))?;
    }
    Ok(())
}

/// Draws a walk's line in dashes.
pub(super) fn draw_walk(area: &Area<'_>, [from, to]: [Vec2; 2]) -> Drawn {
    let ends = [point(from), point(to)];
    area.draw(&DashedPathElement::new(
        ends,
        px(10.0),
        px(7.0),
        INK.stroke_width(px(2.5) as u32),
    ))
}

/// Text with a white rim, for busy grounds.
pub(super) fn draw_label(area: &Area<'_>, at: Vec2, text: &str) -> Drawn {
    let centred = Pos::new(HPos::Center, VPos::Center);
    for k in 0..8 {
        let beside = at + 4.0 * Vec2::from_angle(k as f32 * std::f32::consts::FRAC_PI_4);
        area.draw(&Text::new(
            text,
            point(beside),
            bold_style().color(&WHITE).pos(centred),
        ))?;
    }
    area.draw(&Text::new(text, point(at), bold_style().pos(centred)))
}

/// The centre of a label beside a mark: the first of eight positions that is free and within the plan.
pub(super) fn label_centre(mark: Vec2, half: Vec2, frame: &PlanFrame, taken: &[[Vec2; 2]]) -> Vec2 {
    let (dx, dy) = (half.x + SOURCE_RADIUS + 10.0, half.y + SOURCE_RADIUS + 8.0);
    let offsets = [
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
    let mut centres = offsets.into_iter().map(|(x, y)| mark + vec2(x, y));
    let first = mark + vec2(dx, 0.0);
    centres.find(is_free).unwrap_or(first)
}

/// A bar of a round length of 100 to 250 pixels, its right end at a point.
pub(super) fn draw_scale_bar(area: &Area<'_>, right: Vec2, px_per_m: f32) -> Drawn {
    let least_m = px(100.0) as f32 / px_per_m;
    let decade = 10f32.powf(least_m.log10().floor());
    let lengths = [1.0, 2.0, 5.0].map(|factor| factor * decade);
    let length_m = lengths.into_iter().find(|length| *length >= least_m);
    let length_m = length_m.unwrap_or(10.0 * decade);
    let (text, style) = (
        format!("{length_m} m"),
        text_style(LABEL, TEXT, HPos::Right),
    );
    area.draw(&Text::new(text.as_str(), point(right), style.clone()))?;
    let end = right - vec2(area.estimate_text_size(&text, &style)?.0 as f32 + 20.0, 0.0);
    let start = end - vec2(length_m * px_per_m, 0.0);
    let tick = vec2(0.0, 12.0);
    for ends in [
        [start, end],
        [start - tick, start + tick],
        [end - tick, end + tick],
    ] {
        area.draw(&PathElement::new(
            ends.map(point),
            INK.stroke_width(px(2.0) as u32),
        ))?;
    }
    Ok(())
}
