//! Angles that are written in degrees and kept in radians.

/// Degrees that become those radians again, where there are any: of several those with the fewest digits.
pub fn degrees(radians: f32) -> f32 {
    let near = radians.to_degrees();
    let (up, down) = (near.next_up(), near.next_down());
    let all = [near, up, down, up.next_up(), down.next_down()];
    let same = all.into_iter().filter(|degrees| degrees.to_radians() == radians);
    same.min_by_key(|degrees| degrees.to_string().len()).unwrap_or(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_comes_back_as_it_was_written() {
        for hundredths in 0..36_000_u16 {
            let radians = (f32::from(hundredths) / 100.0).to_radians();
            assert_eq!(degrees(radians).to_radians(), radians, "{hundredths}");
        }
    }
}
