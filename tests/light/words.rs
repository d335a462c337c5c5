//! The words of 16-bit tables.

use wis::light::search::{LAST_WORD, LITTLE, UNITS, start16, variance16, word16, words16};

#[test]
fn words_and_units_agree() {
    for to_ends in [false, true] {
        let starts: Vec<u32> = (0..=LAST_WORD).map(|word| start16(word, to_ends)).collect();
        assert!(starts.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!((starts[0], starts[LAST_WORD as usize]), (0, UNITS as u32));
        let widest = starts.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert!(widest <= Some(260), "{widest:?}");
        for units in 0..UNITS as u32 {
            let word = word16(units, to_ends) as usize;
            assert!(starts[word] <= units && units < starts[word + 1], "{units}");
        }
    }
}

#[test]
fn every_cell_with_mass_has_its_share() {
    let sun = |at: usize, count: usize| -> Vec<f64> {
        (0..count).map(|i| if i == at { 1e6 } else { (i % 5) as f64 * (1.0 + i as f64) }).collect()
    };
    let mut tables: Vec<Vec<f64>> = vec![vec![1.0; 16], vec![0.0; 16], vec![3.0], vec![1e-30, 1.0]];
    tables.push(vec![0.1, 0.7, 0.0, 0.3, 0.1, 0.0, 0.0]);
    tables.push(vec![0.0, 0.0, 1.0 / 3.0, 0.1, 1e-9, 0.0]);
    tables.extend((1..=16).flat_map(|count| (0..count).map(move |at| (at, count))).map(|(at, n)| sun(at, n)));
    for masses in tables {
        let total: f64 = masses.iter().sum();
        for to_ends in [false, true] {
            let words = words16(&masses, to_ends);
            let end = |i: usize| {
                words.get(i).filter(|_| i < masses.len()).map_or(UNITS as u32, |&w| start16(w.into(), to_ends))
            };
            for (i, &mass) in masses.iter().enumerate() {
                let given = f64::from(end(i + 1)) - f64::from(end(i));
                assert!(given > 0.0 || !(mass > 0.0), "{masses:?} {to_ends} {i}");
                let least = (1.0 - 2.0 * LITTLE) * mass / total * f64::from(UNITS);
                assert!(!(mass > 0.0) || given >= least, "{masses:?} {to_ends} {i}: {given} {least}");
            }
            assert!(to_ends || total == 0.0 || variance16(&masses, &words, to_ends) < 1e-3);
        }
        if masses.contains(&1e6) {
            assert!(variance16(&masses, &words16(&masses, true), true) < 1e-5, "{masses:?}");
        }
    }
}
