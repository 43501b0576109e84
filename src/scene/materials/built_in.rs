//! Built-in surface materials, octave bands 63 125 250 500 1k 2k 4k 8k Hz.
//!
//! Absorption: energy, random incidence. The printed tables give 125 Hz to 4 kHz. The 63 Hz and 8 kHz columns are
//! extrapolated here: the neighbour's value, or the table's trend where it is clear.
//! Scattering: share of the reflected energy (ISO 17497-1). Few materials have published values; these are estimates
//! from the size of the relief against the wavelength, in the range of \[VORLANDER08\], appendix.
//! Transmission loss: field-incidence mass law 20 lg(m' f) - 47 dB for the mass in kg/m2 that `source` states, held
//! between 0 and 60 dB, or typical laboratory values where stiffness and coincidence matter (\[BIES18\] chapter 7).
//! Absorption includes transmitted energy: a small absorption of the table bounds the transmission.
//!
//! The values are the tables' common values, quoted from memory and rounded, not measured by this project. Compared with the tables that pyroomacoustics 0.10.1 prints from \[VORLANDER08\]: concrete, plaster, brick,
//! door_wood, upholstered_seat, audience and rock_wool are equal from 125 Hz to 4 kHz, wood_panel (thin plywood
//! panelling) within 0.02. The others have no counterpart there and stay unchecked.
//!
//! - \[BERANEK96\] L. L. Beranek, Concert and Opera Halls: How They Sound, Acoustical Society of America, 1996.
//! - \[BIES18\] D. A. Bies, C. H. Hansen, C. Q. Howard, Engineering Noise Control, 5th ed., CRC Press, 2018, table 6.2
//!   and ch. 7.
//! - \[HARRIS91\] C. M. Harris (ed.), Handbook of Acoustical Measurements and Noise Control, 3rd ed., McGraw-Hill, 1991,
//!   ch. 30.
//! - \[ISO12354\] ISO 12354-1:2017, Building acoustics: airborne sound insulation between rooms, annex B; ISO
//!   12354-6:2003, annex B.
//! - \[ISO9613-2\] ISO 9613-2:1996, Attenuation of sound during propagation outdoors, annex A (foliage).
//! - \[KUTTRUFF\] H. Kuttruff, Room Acoustics, 6th ed., CRC Press, 2016, table of typical absorption coefficients.
//! - \[VORLANDER08\] M. Vorlaender, Auralization, Springer, 2008, appendix.

use super::{MaterialEntry, transmission_of_loss};
use crate::acoustics::bands::BandArray;
use crate::acoustics::material::Material;

/// One row of the table.
struct BuiltIn {
    name: &'static str,
    absorption: BandArray,
    scattering: BandArray,
    loss: Loss,
    source: &'static str,
}

/// Loss of sound through a material.
enum Loss {
    /// Transmission loss in dB.
    Db(BandArray),
    /// Transmission coefficient.
    Energy(BandArray),
}

pub(super) fn entries() -> Vec<MaterialEntry> {
    let entry = |row: &BuiltIn| {
        let transmission = match row.loss {
            Loss::Db(levels) => levels.map(transmission_of_loss),
            Loss::Energy(ratios) => ratios,
        };
        MaterialEntry {
            material: Material {
                name: row.name.to_owned(),
                absorption: row.absorption,
                scattering: row.scattering,
                transmission: std::array::from_fn(|b| transmission[b].min(row.absorption[b])),
            },
            source: row.source.to_owned(),
        }
    };
    TABLE.iter().map(entry).collect()
}

/// In alphabetical order.
const TABLE: &[BuiltIn] = &[
    BuiltIn {
        name: "acoustic_ceiling",
        absorption: [0.4, 0.5, 0.7, 0.6, 0.7, 0.7, 0.5, 0.45],
        scattering: [0.05, 0.05, 0.08, 0.1, 0.12, 0.15, 0.2, 0.2],
        loss: Loss::Db([5.0, 8.0, 10.0, 13.0, 17.0, 20.0, 24.0, 26.0]),
        source: "mineral tile, suspended [BIES18]; single passage, 4 kg/m2",
    },
    BuiltIn {
        name: "asphalt",
        absorption: [0.02, 0.02, 0.03, 0.03, 0.03, 0.03, 0.04, 0.05],
        scattering: [0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.12, 0.2],
        loss: Loss::Db([60.0; 8]),
        source: "dense [VORLANDER08]; ground",
    },
    BuiltIn {
        name: "audience",
        absorption: [0.45, 0.6, 0.74, 0.88, 0.96, 0.93, 0.85, 0.78],
        scattering: [0.2, 0.3, 0.4, 0.55, 0.65, 0.7, 0.75, 0.75],
        loss: Loss::Db([6.0, 8.0, 12.0, 16.0, 20.0, 24.0, 28.0, 30.0]),
        source: "on upholstered seats [BERANEK96]; loss as upholstered_seat",
    },
    BuiltIn {
        name: "brick",
        absorption: [0.03, 0.03, 0.03, 0.03, 0.04, 0.05, 0.07, 0.08],
        scattering: [0.03, 0.04, 0.05, 0.07, 0.1, 0.14, 0.2, 0.25],
        loss: Loss::Db([36.0, 40.0, 44.0, 50.0, 56.0, 60.0, 60.0, 60.0]),
        source: "unglazed, unpainted [BIES18]; 230 mm, 420 kg/m2",
    },
    BuiltIn {
        name: "carpet",
        absorption: [0.02, 0.02, 0.03, 0.05, 0.1, 0.3, 0.5, 0.6],
        scattering: [0.02, 0.03, 0.04, 0.06, 0.1, 0.15, 0.2, 0.25],
        loss: Loss::Db([40.0, 44.0, 50.0, 56.0, 60.0, 60.0, 60.0, 60.0]),
        source: "5 mm on hard floor [KUTTRUFF]; 200 mm slab, 480 kg/m2",
    },
    BuiltIn {
        name: "cinder_block",
        absorption: [0.09, 0.1, 0.05, 0.06, 0.07, 0.09, 0.08, 0.08],
        scattering: [0.03, 0.04, 0.05, 0.08, 0.1, 0.15, 0.2, 0.25],
        loss: Loss::Db([30.0, 34.0, 37.0, 42.0, 49.0, 55.0, 58.0, 60.0]),
        source: "concrete block, painted [BIES18]; 190 mm, 220 kg/m2",
    },
    BuiltIn {
        name: "concrete",
        absorption: [0.01, 0.01, 0.01, 0.02, 0.02, 0.02, 0.05, 0.05],
        scattering: [0.02, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1],
        loss: Loss::Db([40.0, 44.0, 50.0, 56.0, 60.0, 60.0, 60.0, 60.0]),
        source: "smooth, unpainted [VORLANDER08]; 200 mm, 480 kg/m2 [ISO12354]",
    },
    BuiltIn {
        name: "curtain",
        absorption: [0.05, 0.07, 0.31, 0.49, 0.75, 0.7, 0.6, 0.55],
        scattering: [0.05, 0.08, 0.12, 0.2, 0.3, 0.4, 0.5, 0.5],
        loss: Loss::Energy([0.04, 0.05, 0.25, 0.4, 0.22, 0.06, 0.014, 0.004]),
        source: "velour of 475 g/m2 draped to half its area before a wall [HARRIS91]; mass law, held to four fifths of absorption: hung freely it lets more bass through",
    },
    BuiltIn {
        name: "door_wood",
        absorption: [0.15, 0.14, 0.1, 0.06, 0.08, 0.1, 0.1, 0.1],
        scattering: [0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.12, 0.15],
        loss: Loss::Db([15.0, 18.0, 22.0, 25.0, 28.0, 28.0, 30.0, 32.0]),
        source: "solid timber door [VORLANDER08]; 40 mm with ordinary seals, limited by its gaps [BIES18]",
    },
    BuiltIn {
        name: "foliage",
        absorption: [0.98, 0.98, 0.96, 0.94, 0.92, 0.9, 0.88, 0.85],
        scattering: [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9],
        loss: Loss::Db([0.1, 0.1, 0.5, 0.5, 0.5, 0.5, 1.0, 1.5]),
        source: "own: the outside of a crown that sound enters and leaves, each time half of dense foliage's loss over 10 to 20 m [ISO9613-2]; what is reflected is estimated",
    },
    BuiltIn {
        name: "generic",
        absorption: [0.1; 8],
        scattering: [0.1; 8],
        loss: Loss::Db([10.0, 15.0, 21.0, 27.0, 33.0, 39.0, 45.0, 51.0]),
        source: "own: a light wall of 10 kg/m2 that absorbs a tenth; what unknown names get",
    },
    BuiltIn {
        name: "glass",
        absorption: [0.2, 0.18, 0.06, 0.04, 0.03, 0.02, 0.02, 0.02],
        scattering: [0.01, 0.01, 0.02, 0.02, 0.03, 0.04, 0.05, 0.06],
        loss: Loss::Db([13.0, 18.0, 24.0, 29.0, 33.0, 28.0, 36.0, 42.0]),
        source: "large panes of heavy plate [HARRIS91]; 6 mm, 15 kg/m2, coincidence at 2 kHz [BIES18]",
    },
    BuiltIn {
        name: "grass",
        absorption: [0.08, 0.11, 0.26, 0.6, 0.69, 0.92, 0.99, 0.99],
        scattering: [0.05, 0.1, 0.15, 0.25, 0.35, 0.45, 0.55, 0.6],
        loss: Loss::Db([60.0; 8]),
        source: "50 mm high [HARRIS91]; ground",
    },
    BuiltIn {
        name: "gravel",
        absorption: [0.15, 0.25, 0.6, 0.65, 0.7, 0.75, 0.8, 0.8],
        scattering: [0.05, 0.08, 0.12, 0.2, 0.35, 0.5, 0.6, 0.65],
        loss: Loss::Db([60.0; 8]),
        source: "loose and moist, 100 mm [HARRIS91]; ground",
    },
    BuiltIn {
        name: "gypsum_board",
        absorption: [0.3, 0.29, 0.1, 0.05, 0.04, 0.07, 0.09, 0.09],
        scattering: [0.02, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1],
        loss: Loss::Db([10.0, 16.0, 28.0, 38.0, 45.0, 48.0, 42.0, 46.0]),
        source: "13 mm on studs [BIES18]; both sides, 75 mm cavity, typical laboratory values",
    },
    BuiltIn {
        name: "linoleum",
        absorption: [0.02, 0.02, 0.03, 0.03, 0.03, 0.03, 0.02, 0.02],
        scattering: [0.02, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1],
        loss: Loss::Db([40.0, 44.0, 50.0, 56.0, 60.0, 60.0, 60.0, 60.0]),
        source: "on concrete [HARRIS91]; 200 mm slab, 480 kg/m2",
    },
    BuiltIn {
        name: "marble",
        absorption: [0.01, 0.01, 0.01, 0.01, 0.01, 0.02, 0.02, 0.03],
        scattering: [0.01, 0.01, 0.02, 0.02, 0.03, 0.04, 0.05, 0.06],
        loss: Loss::Db([40.0, 44.0, 50.0, 56.0, 60.0, 60.0, 60.0, 60.0]),
        source: "marble or glazed tile [BIES18]; on 200 mm masonry",
    },
    BuiltIn {
        name: "parquet_on_concrete",
        absorption: [0.04, 0.04, 0.04, 0.07, 0.06, 0.06, 0.07, 0.07],
        scattering: [0.02, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.12],
        loss: Loss::Db([40.0, 44.0, 50.0, 56.0, 60.0, 60.0, 60.0, 60.0]),
        source: "in asphalt on concrete [HARRIS91]; 200 mm slab, 480 kg/m2",
    },
    BuiltIn {
        name: "plaster",
        absorption: [0.02, 0.02, 0.02, 0.03, 0.03, 0.04, 0.05, 0.05],
        scattering: [0.02, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.12],
        loss: Loss::Db([34.0, 38.0, 40.0, 46.0, 52.0, 58.0, 60.0, 60.0]),
        source: "hard surfaces, plaster on solid wall [KUTTRUFF]; on 115 mm masonry, 220 kg/m2 [ISO12354]",
    },
    BuiltIn {
        name: "plywood",
        absorption: [0.3, 0.28, 0.22, 0.17, 0.09, 0.1, 0.11, 0.11],
        scattering: [0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.12, 0.15],
        loss: Loss::Db([7.0, 12.0, 17.0, 21.0, 25.0, 28.0, 27.0, 32.0]),
        source: "10 mm [HARRIS91]; 6 kg/m2",
    },
    BuiltIn {
        name: "rock_wool",
        absorption: [0.12, 0.22, 0.6, 0.92, 0.9, 0.88, 0.88, 0.88],
        scattering: [0.05, 0.05, 0.08, 0.1, 0.1, 0.12, 0.15, 0.15],
        loss: Loss::Db([10.0, 8.0, 6.0, 8.0, 12.0, 18.0, 26.0, 34.0]),
        source: "50 mm, 60 kg/m3, on solid wall [BIES18]; bare slab, loss bounded by absorption in the bass",
    },
    BuiltIn {
        name: "sandbag",
        absorption: [0.1, 0.15, 0.35, 0.4, 0.5, 0.55, 0.8, 0.85],
        scattering: [0.1, 0.2, 0.3, 0.45, 0.55, 0.6, 0.6, 0.6],
        loss: Loss::Db([43.0, 49.0, 55.0, 60.0, 60.0, 60.0, 60.0, 60.0]),
        source: "dry sand [HARRIS91]; 300 mm, 480 kg/m2",
    },
    BuiltIn {
        name: "snow",
        absorption: [0.3, 0.45, 0.75, 0.9, 0.95, 0.95, 0.95, 0.95],
        scattering: [0.05, 0.08, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35],
        loss: Loss::Db([60.0; 8]),
        source: "fresh, 100 mm [HARRIS91]; ground",
    },
    BuiltIn {
        name: "soil",
        absorption: [0.1, 0.15, 0.25, 0.4, 0.55, 0.6, 0.6, 0.6],
        scattering: [0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.55],
        loss: Loss::Db([60.0; 8]),
        source: "rough soil [HARRIS91]; ground",
    },
    BuiltIn {
        name: "steel",
        absorption: [0.05, 0.05, 0.1, 0.1, 0.1, 0.07, 0.02, 0.02],
        scattering: [0.01, 0.01, 0.02, 0.03, 0.05, 0.06, 0.08, 0.1],
        loss: Loss::Db([18.0, 24.0, 30.0, 36.0, 42.0, 47.0, 45.0, 50.0]),
        source: "sheet metal, common table values [VORLANDER08]; 4 mm, 31 kg/m2 [BIES18]",
    },
    BuiltIn {
        name: "tile",
        absorption: [0.01, 0.01, 0.01, 0.01, 0.01, 0.02, 0.02, 0.03],
        scattering: [0.02, 0.02, 0.03, 0.03, 0.04, 0.05, 0.07, 0.1],
        loss: Loss::Db([36.0, 40.0, 44.0, 50.0, 56.0, 60.0, 60.0, 60.0]),
        source: "glazed tile [BIES18]; on 230 mm brick",
    },
    BuiltIn {
        name: "upholstered_seat",
        absorption: [0.35, 0.49, 0.66, 0.8, 0.88, 0.82, 0.7, 0.62],
        scattering: [0.2, 0.3, 0.4, 0.5, 0.6, 0.65, 0.7, 0.7],
        loss: Loss::Db([6.0, 8.0, 12.0, 16.0, 20.0, 24.0, 28.0, 30.0]),
        source: "cloth-upholstered, unoccupied [BERANEK96]; loss estimated for 20 kg/m2 with gaps",
    },
    BuiltIn {
        name: "water",
        absorption: [0.01, 0.01, 0.01, 0.01, 0.02, 0.02, 0.03, 0.03],
        scattering: [0.02, 0.02, 0.03, 0.05, 0.08, 0.1, 0.15, 0.2],
        loss: Loss::Db([40.0; 8]),
        source: "pool surface [BIES18]; loss estimated, bounded by absorption",
    },
    BuiltIn {
        name: "wood_floor",
        absorption: [0.15, 0.15, 0.11, 0.1, 0.07, 0.06, 0.07, 0.07],
        scattering: [0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.12, 0.15],
        loss: Loss::Db([14.0, 18.0, 24.0, 30.0, 36.0, 40.0, 44.0, 48.0]),
        source: "boards on joists [HARRIS91]; with ceiling, 25 kg/m2",
    },
    BuiltIn {
        name: "wood_panel",
        absorption: [0.42, 0.4, 0.2, 0.12, 0.07, 0.05, 0.05, 0.05],
        scattering: [0.05, 0.06, 0.08, 0.1, 0.1, 0.12, 0.15, 0.18],
        loss: Loss::Db([9.0, 14.0, 19.0, 24.0, 28.0, 30.0, 32.0, 36.0]),
        source: "panelling over air space, strongly vibrating [KUTTRUFF]; 18 mm, 11 kg/m2",
    },
];
