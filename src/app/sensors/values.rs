//! Text of measured values at a place of a sensor's picture.

use crate::app::sensors::choice::Choice;
use crate::name;
use crate::sense::{CameraCapture, Flow, ObjectBox, SensorCapture, SensorData, entity_of_number, flags};
use bevy_ecs::prelude::*;
use glam::Vec2;
use systems::sensors::{CameraOutput, Class, Classes};

/// At a place of a picture, which goes from 0 to 1 to the right and down. `reach`: of a view from above, metres from
/// its middle to its sides.
pub fn at(world: &World, capture: &SensorCapture, choice: Choice, place: Vec2, reach: Option<f32>) -> Option<String> {
    match (&capture.data, choice) {
        (SensorData::Camera(camera), Choice::Output(output)) => {
            let (x, y) = ((place.x * camera.width as f32) as u32, (place.y * camera.height as f32) as u32);
            let is_inside = place.cmpge(Vec2::ZERO).all() && x < camera.width && y < camera.height;
            is_inside.then(|| of_pixel(world, camera, output, (x, y)))?
        }
        (SensorData::Lidar(_), Choice::Points(_)) => {
            let reach = reach?;
            let [left, forward] = [0.5 - place.x, 0.5 - place.y].map(|part| part * 2.0 * reach);
            let side = if left < 0.0 { "right" } else { "left" };
            let ahead = if forward < 0.0 { "behind" } else { "ahead" };
            Some(format!("{:.1} m {ahead}, {:.1} m {side}", forward.abs(), left.abs()))
        }
        _ => None,
    }
}

/// At a pixel. `None` where the output was not captured.
fn of_pixel(world: &World, camera: &CameraCapture, output: CameraOutput, (x, y): (u32, u32)) -> Option<String> {
    let i = (y * camera.width + x) as usize;
    let value = match output {
        CameraOutput::Color => {
            let [r, g, b] = camera.color.get(i)?;
            format!("{r}, {g}, {b}")
        }
        CameraOutput::Linear => {
            let [r, g, b] = camera.linear.get(i)?;
            format!("{r:.4}, {g:.4}, {b:.4}")
        }
        CameraOutput::Depth => metres(*camera.depth.get(i)?),
        CameraOutput::Range => metres(*camera.range.get(i)?),
        CameraOutput::Normal => {
            let [right, down, forward] = camera.normal.get(i)?;
            format!("{right:.3}, {down:.3}, {forward:.3}")
        }
        CameraOutput::Instance => thing(world, *camera.instance.get(i)?),
        CameraOutput::Part => thing(world, *camera.part.get(i)?),
        CameraOutput::Class => class(world, *camera.class.get(i)?),
        CameraOutput::Boxes => of_boxes(world, camera, (x, y)),
        CameraOutput::Flow => shift(&camera.flow, i)?,
        CameraOutput::FlowBack => shift(&camera.flow_back, i)?,
        CameraOutput::Panoptic => {
            let number = *camera.panoptic.get(i)?;
            match u8::try_from(number) {
                Ok(stuff) => class(world, stuff),
                Err(_) => format!("{number}: {} {}", class_name(world, (number / 1000) as u8), number % 1000),
            }
        }
    };
    Some(format!("({x}, {y})  {value}"))
}

/// The nearest thing whose seen part is around a pixel.
fn of_boxes(world: &World, camera: &CameraCapture, (x, y): (u32, u32)) -> String {
    let is_around = |one: &&ObjectBox| {
        let [left, top, right, bottom] = one.box_visible;
        (left..right).contains(&(x as f32)) && (top..bottom).contains(&(y as f32))
    };
    let nearest = camera.boxes.iter().filter(is_around).min_by(|a, b| a.center[2].total_cmp(&b.center[2]));
    nearest.map_or_else(
        || "nothing".to_owned(),
        |one| format!("{}, {:.0} % seen, {:.1} m", thing(world, one.id), 100.0 * one.visible, one.center[2]),
    )
}

fn shift(flow: &Flow, i: usize) -> Option<String> {
    let ([right, down], flags) = (flow.pixels.get(i)?, flow.flags.get(i)?);
    Some(if flags & flags::VALID == 0 { "nothing".to_owned() } else { format!("{right:.2}, {down:.2} pixels") })
}

fn metres(metres: f32) -> String {
    if metres.is_finite() { format!("{metres:.3} m") } else { "nothing".to_owned() }
}

fn thing(world: &World, number: u32) -> String {
    match (number, entity_of_number(world, number)) {
        (0, _) => "nothing".to_owned(),
        (_, None) => format!("{number}: gone"),
        (_, Some(entity)) => format!("{number}: {}", name::of_entity(world, entity)),
    }
}

fn class(world: &World, id: u8) -> String {
    format!("{id}: {}", class_name(world, id))
}

fn class_name(world: &World, id: u8) -> &str {
    let info = world.get_resource::<Classes>().and_then(|classes| classes.get(Class(id)));
    info.map_or("unknown", |info| info.name.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::pictures::PointValue;
    use crate::sense::LidarCapture;
    use systems::run::registry::register_all;

    #[test]
    fn values_are_read_at_the_pixel_under_the_pointer() {
        let mut simulation = systems::Simulation::new();
        let van = simulation.world.spawn(Name::new("van")).id();
        register_all(&mut simulation.world);
        let world = &simulation.world;
        let number = world.resource::<systems::run::registry::EntityRegistry>().id(van).expect("registered").0 + 1;
        let camera = CameraCapture {
            width: 2,
            height: 2,
            color: vec![[1, 2, 3]; 4],
            depth: vec![f32::INFINITY, 1.0, 2.5, 3.0],
            normal: vec![[0.0, 1.0, -0.5]; 4],
            instance: vec![0, 1 << 30, number, 0],
            class: vec![26; 4],
            panoptic: vec![7, 26_003, 0, 0],
            ..CameraCapture::default()
        };
        let capture = |data| SensorCapture {
            entity: van,
            name: String::new(),
            world_from_sensor: glam::DAffine3::IDENTITY,
            first_column: None,
            data,
        };
        let seen = capture(SensorData::Camera(camera));
        let read = |output, x, y| at(world, &seen, Choice::Output(output), Vec2::new(x, y), None);
        assert_eq!(read(CameraOutput::Depth, 0.49, 0.5).as_deref(), Some("(0, 1)  2.500 m"));
        assert_eq!(read(CameraOutput::Depth, 0.0, 0.0).as_deref(), Some("(0, 0)  nothing"));
        assert_eq!([read(CameraOutput::Depth, 1.0, 0.0), read(CameraOutput::Depth, -0.1, 0.0)], [None, None]);
        assert_eq!(read(CameraOutput::Range, 0.0, 0.0), None, "not captured");
        assert_eq!(read(CameraOutput::Color, 0.9, 0.9).as_deref(), Some("(1, 1)  1, 2, 3"));
        assert_eq!(read(CameraOutput::Normal, 0.9, 0.9).as_deref(), Some("(1, 1)  0.000, 1.000, -0.500"));
        assert_eq!(read(CameraOutput::Instance, 0.1, 0.9), Some(format!("(0, 1)  {number}: van")));
        assert_eq!(read(CameraOutput::Instance, 0.9, 0.1).as_deref(), Some("(1, 0)  1073741824: gone"));
        assert_eq!(read(CameraOutput::Instance, 0.9, 0.9).as_deref(), Some("(1, 1)  nothing"));
        assert_eq!(read(CameraOutput::Class, 0.9, 0.9).as_deref(), Some("(1, 1)  26: car"));
        assert_eq!(read(CameraOutput::Panoptic, 0.1, 0.1).as_deref(), Some("(0, 0)  7: road"));
        assert_eq!(read(CameraOutput::Panoptic, 0.9, 0.1).as_deref(), Some("(1, 0)  26003: car 3"));

        let scan = capture(SensorData::Lidar(LidarCapture::default()));
        let points = Choice::Points(PointValue::Height);
        let read = |x, y| at(world, &scan, points, Vec2::new(x, y), Some(20.0));
        assert_eq!(read(0.5, 0.25).as_deref(), Some("10.0 m ahead, 0.0 m left"));
        assert_eq!(read(1.0, 0.75).as_deref(), Some("10.0 m behind, 20.0 m right"));
    }
}
