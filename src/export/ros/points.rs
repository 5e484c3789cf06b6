//! Clouds of points.

use super::message::{Header, Message};
use crate::export::array::{Column, Values, interleave};
use crate::export::cdr::Encoder;
use crate::export::checks::unfit;
use std::io::Result;

/// Points with what is known of each, as `sensor_msgs/PointCloud2` of one row: the fields x, y, z, then the columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointCloud2<'a> {
    /// When they were captured; the frame that they are in.
    pub header: Header<'a>,
    /// x, y, z in metres.
    pub points: &'a [[f32; 3]],
    /// Further values of the points, such as `intensity`, `ring` and `time`; half floats have no place.
    pub columns: &'a [Column<'a>],
}

/// The number of a type (`sensor_msgs/PointField`).
fn datatype(column: &Column) -> Result<u8> {
    match column.values {
        Values::U8(_) => Ok(2),
        Values::U16(_) => Ok(4),
        Values::I32(_) => Ok(5),
        Values::U32(_) => Ok(6),
        Values::F32(_) => Ok(7),
        Values::F64(_) => Ok(8),
        Values::F16(_) => Err(unfit(format!("PointCloud2: {} is of half floats, which have no number", column.name))),
    }
}

impl Message for PointCloud2<'_> {
    const TYPE: &'static str = "sensor_msgs/msg/PointCloud2";
    const FIELDS: &'static str = "\
        std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n\
        bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        let columns = [&[Column::new("xyz", &[3], self.points.as_flattened())], self.columns].concat();
        let data = interleave(self.points.len(), &columns)?;
        let small = |number: usize| u32::try_from(number).map_err(|_| unfit("PointCloud2: more than 4 GiB"));
        let mut fields: Vec<(&str, u8, usize)> = ["x", "y", "z"].map(|name| (name, 7, 1)).to_vec();
        for column in self.columns {
            if fields.iter().any(|(before, ..)| *before == column.name) {
                return Err(unfit(format!("PointCloud2: two fields are named \"{}\"", column.name)));
            }
            fields.push((column.name, datatype(column)?, column.per_record()?));
        }
        self.header.put(cdr)?;
        cdr.number(1_u32);
        cdr.number(small(self.points.len())?);
        let sizes = [4; 3].into_iter().chain(self.columns.iter().map(|column| column.values.value_bytes()));
        let mut offset = 0;
        cdr.length(fields.len())?;
        for ((name, kind, count), size) in fields.into_iter().zip(sizes) {
            cdr.string(name)?;
            cdr.number(small(offset)?);
            cdr.number(kind);
            cdr.number(small(count)?);
            offset += count * size;
        }
        cdr.bool(false);
        cdr.number(small(offset)?);
        cdr.number(small(data.len())?);
        cdr.bytes(&data)?;
        // Whether all points are places.
        cdr.bool(Values::from(self.points.as_flattened()).are_finite());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use half::f16;

    fn encode(points: &[[f32; 3]], columns: &[Column]) -> Result<Vec<u8>> {
        PointCloud2 { header: Header { nanoseconds: 0, frame: "" }, points, columns }.encode()
    }

    #[test]
    fn what_has_no_place_is_refused() {
        let refusal = |column| encode(&[[0.0; 3]], &[column]).unwrap_err().to_string();
        let halves = Column::new("time", &[], &[f16::ONE][..]);
        assert_eq!(refusal(halves), "PointCloud2: time is of half floats, which have no number");
        assert_eq!(refusal(Column::new("x", &[], &[1_u8][..])), "PointCloud2: two fields are named \"x\"");
        assert_eq!(refusal(Column::new("ring", &[], &[1_u8, 2][..])), "ring: expected 1 values, found 2");
    }

    #[test]
    fn a_cloud_is_dense_where_all_points_are_places() {
        let is_dense = |x| encode(&[[x, 0.0, 0.0]], &[]).unwrap().last().copied();
        assert_eq!((is_dense(1.0), is_dense(f32::NAN)), (Some(1), Some(0)));
    }
}
