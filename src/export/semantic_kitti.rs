//! Labels of the points of a scan, as SemanticKITTI has them beside KITTI's own files (Behley and others,
//! "SemanticKITTI: A Dataset for Semantic Scene Understanding of LiDAR Sequences", ICCV 2019): 32 bits a point.

use super::checks::{check_count, unfit};
use std::io::Result;

/// A `.label` file: the class of each point in the lower 16 bits, its instance in the upper ones, 0 for none. Classes
/// are written as they are, not as that data set numbers them.
///
/// # Errors
/// Not as many instances as points; an instance beyond 65,535.
pub fn encode(classes: &[u8], instances: &[u32]) -> Result<Vec<u8>> {
    check_count("SemanticKITTI instances", classes.len(), instances.len())?;
    let mut bytes = Vec::with_capacity(4 * classes.len());
    for (class, instance) in classes.iter().zip(instances) {
        let upper = u16::try_from(*instance);
        let upper = upper.map_err(|_| unfit(format!("SemanticKITTI: instance {instance} is beyond 65,535")))?;
        bytes.extend([u16::from(*class).to_le_bytes(), upper.to_le_bytes()].concat());
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_is_class_and_instance() {
        assert_eq!(encode(&[7, 26], &[0, 0x0102]).unwrap(), [7, 0, 0, 0, 26, 0, 2, 1]);
        let refusal = |instances: &[u32]| encode(&[26], instances).unwrap_err().to_string();
        assert_eq!(refusal(&[65_536]), "SemanticKITTI: instance 65536 is beyond 65,535");
        assert_eq!(refusal(&[]), "SemanticKITTI instances: expected 1 values, found 0");
    }
}
