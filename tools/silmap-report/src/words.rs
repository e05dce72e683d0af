//! Formatting of numbers on the page.

/// A share in percent with three digits behind the point: escaped pixels are counted in hundredths of a percent.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.3}", 100.0 * share)
}

/// Milliseconds, to the microsecond.
pub(crate) fn millis(seconds: f64) -> String {
    format!("{:.3}", 1e3 * seconds)
}

/// A number with four digits that matter, in plain decimals.
pub(crate) fn significant(value: f64) -> String {
    let before = if value == 0.0 {
        0
    } else {
        value.abs().log10().floor() as i32 + 1
    };
    let behind = (4 - before).clamp(0, 9) as usize;
    let text = format!("{value:.behind$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A whole number with its digits in threes.
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
