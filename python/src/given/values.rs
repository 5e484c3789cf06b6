//! Values of arguments: numbers in sequences or arrays, places, and how things are turned.

use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Argument, Given, found, items, number, optional, within};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use relief::glam::{DAffine3, DVec3, Quat, Vec3};
use relief::systems::space::{FARTHEST, LARGEST, Transform};
use std::f32::consts::PI;

/// So many numbers of any sequence or array, finite ones.
#[derive(Clone, Copy, Debug)]
pub struct Numbers<const N: usize>(pub [f64; N]);

impl<'a, 'py, const N: usize> FromPyObject<'a, 'py> for Numbers<N> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let given = given.to_owned();
        let fault = || PyValueError::new_err(format!("expected {}, found {}", Self::expected(), found(&given)));
        let numbers: [f64; N] = flat(&given, N + 1)?.try_into().map_err(|_| fault())?;
        if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
            return Err(PyValueError::new_err(format!("expected finite numbers, found {number}")));
        }
        Ok(Self(numbers))
    }
}

impl<const N: usize> Argument for Numbers<N> {
    fn expected() -> String {
        // Of all of these, they alone are matrices.
        if N == 16 { "a matrix of 4 by 4 numbers".into() } else { format!("{N} numbers") }
    }
}

/// The numbers of a sequence, or of a sequence of such, row by row; no more than so many.
fn flat(given: &Bound<'_, PyAny>, most: usize) -> PyResult<Vec<f64>> {
    let mut numbers = Vec::new();
    for item in items(given)? {
        let item = item?;
        match number(&item) {
            Ok(number) => numbers.push(number),
            Err(error) => {
                let Ok(row) = items(&item) else { return Err(error) };
                for inner in row {
                    numbers.push(number(&inner?)?);
                }
            }
        }
        if numbers.len() >= most {
            break;
        }
    }
    Ok(numbers)
}

/// A place, metres.
#[derive(Clone, Copy, Debug)]
pub struct Point(pub DVec3);

impl<'a, 'py> FromPyObject<'a, 'py> for Point {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let Numbers(numbers) = Numbers::<3>::extract(given)?;
        match numbers.iter().find(|number| number.abs() > FARTHEST) {
            Some(far) => {
                Err(PyValueError::new_err(format!("expected metres from -{FARTHEST} to {FARTHEST}, found {far}")))
            }
            None => Ok(Self(numbers.into())),
        }
    }
}

impl Argument for Point {
    fn expected() -> String {
        Numbers::<3>::expected()
    }
}

/// Place and rotation of something: by angles, or toward a point.
#[derive(Clone, Copy, Debug)]
pub struct Placing {
    pub at: DVec3,
    /// Radians: to the left, up, and with the right side down.
    pub turn: [f32; 3],
    pub look_at: Option<DVec3>,
}

/// Axis of an entity that points where it is turned to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Facing {
    /// +Z: vehicles, lidars, meshes.
    Forward,
    /// −Z: cameras and lights.
    Backward,
}

impl Placing {
    /// Reads arguments of these names; `turn`: yaw, pitch and roll.
    pub fn read(at: Given<'_, '_>, turn: [Given<'_, '_>; 3], look_at: Given<'_, '_>) -> PyResult<Self> {
        let at = optional::<Point>("at", at)?.map_or(DVec3::ZERO, |at| at.0);
        let mut angles = [0.0; 3];
        for ((name, given), angle) in ["yaw", "pitch", "roll"].into_iter().zip(turn).zip(&mut angles) {
            *angle = within(name, given, "radians", -1e4..=1e4)?.unwrap_or(0.0);
        }
        let look_at = optional::<Point>("look_at", look_at)?.map(|point| point.0);
        if look_at.is_some() && angles[..2] != [0.0, 0.0] {
            return Err(Failure::value("look_at: expected either look_at, or yaw and pitch").into());
        }
        if look_at.is_some_and(|target| target.distance(at) < 1e-6) {
            return Err(Failure::value("look_at: expected another point than at").into());
        }
        Ok(Self { at, turn: angles.map(|angle| angle as f32), look_at })
    }

    /// Tells if it is rotated at all.
    pub fn is_turned(&self) -> bool {
        self.look_at.is_some() || self.turn != [0.0; 3]
    }

    /// For a vehicle, which stands as its ground does: toward what it looks at it is turned by yaw alone.
    pub fn of_vehicle(mut self) -> Outcome<Self> {
        if self.turn[1..] != [0.0, 0.0] {
            return Err(Failure::value("pitch, roll: expected 0, since a vehicle stands as its ground does"));
        }
        if let Some(target) = &mut self.look_at {
            target.y = self.at.y;
            if target.distance(self.at) < 1e-6 {
                return Err(Failure::value("look_at: expected no point straight above or below at, for a vehicle"));
            }
        }
        Ok(self)
    }

    /// In coordinates that count from `origin`.
    pub fn transform(&self, origin: DVec3, facing: Facing) -> Transform {
        let at = Transform::from_translation((self.at - origin).as_vec3());
        let half_turn = Quat::from_rotation_y(PI);
        let [yaw, pitch, roll] = self.turn;
        if let Some(target) = self.look_at {
            let looking = at.looking_to((target - self.at).as_vec3(), Vec3::Y);
            // Right side down, looking along −Z.
            let rolled = looking.rotation * Quat::from_rotation_z(-roll);
            return at.with_rotation(match facing {
                Facing::Backward => rolled,
                Facing::Forward => rolled * half_turn,
            });
        }
        let forward = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(-pitch) * Quat::from_rotation_z(roll);
        at.with_rotation(match facing {
            Facing::Forward => forward,
            Facing::Backward => forward * half_turn,
        })
    }
}

/// A matrix of 4 by 4, float64.
pub fn matrix<'py>(py: Python<'py>, place: &DAffine3) -> Bound<'py, PyArray2<f64>> {
    let columns = relief::glam::DMat4::from(*place).to_cols_array_2d();
    Array2::from_shape_fn((4, 4), |(row, column)| columns[column][row]).into_pyarray(py)
}

/// From a matrix of 4 by 4 whose last row is (0, 0, 0, 1), to a place, rotation and scale.
pub fn transform_of(matrix: &[f64; 16]) -> Outcome<Transform> {
    if matrix[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(Failure::value(format!("transform: expected a last row of 0, 0, 0, 1, found {:?}", &matrix[12..])));
    }
    let column = |i: usize| DVec3::new(matrix[i], matrix[4 + i], matrix[8 + i]);
    let place = DAffine3::from_cols(column(0), column(1), column(2), column(3));
    if place.matrix3.determinant().abs() < 1e-12 {
        return Err(Failure::value("transform: expected a matrix that can be inverted"));
    }
    let (scale, rotation, translation) = place.to_scale_rotation_translation();
    if translation.abs().max_element() > FARTHEST {
        return Err(Failure::value(format!("transform: expected metres from -{FARTHEST} to {FARTHEST}")));
    }
    if scale.abs().max_element() > LARGEST {
        return Err(Failure::value(format!("transform: expected factors of scale from -{LARGEST} to {LARGEST}")));
    }
    // Within what matrices of single floats come with: 2^-23, times some operations.
    let axes = [place.matrix3.x_axis, place.matrix3.y_axis, place.matrix3.z_axis].map(DVec3::normalize);
    if axes[0].dot(axes[1]).abs().max(axes[1].dot(axes[2]).abs()).max(axes[2].dot(axes[0]).abs()) > 1e-5 {
        return Err(Failure::value("transform: expected axes at right angles, found a sheared matrix"));
    }
    let rotation = rotation.as_quat().normalize();
    Ok(Transform { translation: translation.as_vec3(), rotation, scale: scale.as_vec3() })
}
