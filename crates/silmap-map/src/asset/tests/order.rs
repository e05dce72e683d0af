//! The order in which views can go, in the file: sound ones come back, others are refused.

use super::super::*;
use super::small_asset;

/// A map of three views that may lose one, then another.
fn asset_with_order() -> Asset {
    let step = |removed, onto| CollapseStep {
        removed,
        onto,
        ..CollapseStep::default()
    };
    let mut asset = small_asset();
    asset.record.order = Some(CollapseOrder {
        steps: vec![step(1, 0), step(2, 0)],
        ..CollapseOrder::default()
    });
    asset
}

#[test]
fn an_order_that_uses_missing_views_is_refused() {
    type Break = fn(&mut CollapseStep);
    let breaks: [(&str, Break, &str); 5] = [
        (
            "no such view",
            |s| s.removed = 3,
            "view 3 does not exist: there are 3",
        ),
        (
            "onto a removed view",
            |s| s.onto = 1,
            "it is damaged: step 1 of its collapse order names a view that went before",
        ),
        (
            "onto itself",
            |s| s.onto = 2,
            "it is damaged: step 1 of its collapse order uses the view that it removes",
        ),
        (
            "an edge of the removed view",
            |s| s.turned.push([0, 2]),
            "it is damaged: step 1 of its collapse order uses the view that it removes",
        ),
        (
            "no number",
            |s| s.errors.max = f64::NAN,
            "misclassified share NaN cannot be stored: it must be finite and at most 3.403e38 in size",
        ),
    ];
    let sound = asset_with_order();
    assert_eq!(
        read(&write(&sound).unwrap()).unwrap(),
        quantise(&sound).unwrap()
    );
    for (what, break_it, sentence) in breaks {
        let mut asset = sound.clone();
        let steps = asset.record.order.as_mut().map(|order| &mut order.steps);
        break_it(&mut steps.unwrap()[1]);
        let refused = write(&asset).unwrap_err();
        assert_eq!(refused.to_string(), sentence, "{what}");
    }
}

#[test]
fn a_damaged_order_in_a_file_is_refused() {
    let sound = asset_with_order();
    let bytes = super::super::order::encode(&sound.record, 3)
        .unwrap()
        .unwrap();
    let file = write(&sound).unwrap();
    let at = (file.windows(bytes.len()).position(|w| w == bytes)).unwrap();
    let with = |changes: &[(usize, u8)]| {
        let mut broken = file.clone();
        for &(offset, value) in changes {
            broken[at + offset] = value;
        }
        super::super::write::seal(&mut broken).unwrap();
        read(&broken).map(|_| ()).map_err(|e| e.to_string())
    };
    // Two shares, the number of steps, then view, neighbour, two shares and the number of edges of each.
    assert_eq!(with(&[(8, 2)]), Ok(()));
    for (changes, words) in [
        (&[(9, 100)][..], "view 100 does not exist"),
        (&[(9, 2)], "step 1 of its collapse order"),
        (&[(10, 1)], "step 0 of its collapse order"),
        (&[(8, 1)], "too many"),
        (&[(8, 3)], "end too early"),
        (&[(2, 0x80), (3, 0x7f)], "must be finite"),
    ] {
        let refused = with(changes).unwrap_err();
        assert!(refused.contains(words), "{refused}");
    }
}
