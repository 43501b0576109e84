//! Level, cost and fidelity of each predictor in one row, beside the reference against itself with another ray seed.

use super::Row;
use super::figures_of_merit::figures;
use super::html::{NONE, escaped, figure, row, table};
use crate::cells::Condition;
use crate::si_snr::capped_text;

/// The section's content: cells in motion; empty without any.
pub(super) fn equal_terms(rows: &[Row]) -> String {
    let head = [
        "cell",
        "predictor",
        "L",
        "update ms",
        "of the reference's",
        "L by its own updates",
        "EPS, share of a core",
        "PESQ",
        "SSIM",
        "SI-SNR dB",
    ];
    let (mut body, mut last) = (String::new(), "");
    let fits = |r: &&Row| r.condition != Condition::Static && r.is_late && r.signal == "speech";
    for r in rows.iter().filter(fits) {
        let is_new = r.wav_stem != std::mem::replace(&mut last, &r.wav_stem);
        let [pesq, ssim, si_snr] = figures(r).map(figure);
        let [median, high] = r.extrapolation_level;
        let level = match high > median {
            true => format!("{median:.0} (99 %: {high:.0})"),
            false => format!("{median:.0}"),
        };
        let name = match is_new {
            true => escaped(&r.wav_stem),
            false => String::new(),
        };
        body.push_str(&row(
            if is_new { "begins" } else { "" },
            &[
                name,
                escaped(&r.predictor),
                level,
                format!("{:.2}", r.update_ms),
                r.update_ratio()
                    .map_or(NONE.to_owned(), |ratio| format!("{ratio:.2}×")),
                r.own_level()
                    .map_or(NONE.to_owned(), |level| level.to_string()),
                format!("{:.1} %", 100.0 * r.extrapolation_share()),
                pesq,
                ssim,
                si_snr,
            ],
        ));
        if let Some(other) = r.other_seed.filter(|_| is_new) {
            let mut cells = vec![String::new(), "reference, other rays".to_owned()];
            cells.resize(7, NONE.to_owned());
            cells.push(other.pesq.map_or(NONE.to_owned(), |p| format!("{p:.2}")));
            cells.push(format!("{:.4}", other.ssim));
            cells.push(escaped(&capped_text(other.si_snr_db)));
            body.push_str(&row("", &cells));
        }
    }
    if body.is_empty() {
        return body;
    }
    format!(
        "<p>Reference and estimate share the seed of their rays: the figures are the error of asynchrony alone. The line \
         <i>reference, other rays</i> compares the reference with itself under another seed, which is the error of the \
         rays. L is the level that was rendered; <i>L by its own updates</i> is the level that follows if the \
         reference's updates take L + ½ graphics frames and the predictor's take longer by the ratio beside. Times are of \
         this run, with other renderings at work.</p>{}",
        table("names", "", &head, &body)
    )
}

impl Row {
    /// Time of an update over that of the reference's.
    pub fn update_ratio(&self) -> Option<f64> {
        (self.reference_update_ms > 0.0).then(|| self.update_ms / self.reference_update_ms)
    }

    /// The level that follows from the time of its own updates, where updates of the reference's cost follow from the
    /// rendered level.
    pub fn own_level(&self) -> Option<u32> {
        let frames = (f64::from(self.level) + 0.5) * self.update_ratio()?;
        Some((frames.floor() as u32).max(1))
    }
}

#[cfg(test)]
mod tests {
    use crate::report::tests::row;

    #[test]
    fn dearer_updates_have_a_higher_level() {
        let mut row = row();
        row.level = 12;
        row.reference_update_ms = 10.0;
        for (update_ms, level) in [(10.0, 12), (13.0, 16), (20.0, 25), (0.1, 1)] {
            row.update_ms = update_ms;
            assert_eq!(row.own_level(), Some(level));
        }
        row.reference_update_ms = 0.0;
        assert_eq!(row.own_level(), None);
    }
}
