//! The data sets of the parts of a run, put together to that of the run. Files of single captures are all there, and
//! stay as they are; what is made of a run as a whole is made of what the parts have of it.
//!
//! ```text
//! sensors.json      the captures of all
//! sensors.mcap      the messages of all, in their order, through the writer that has written them
//! coco/*.json       the pictures of all, numbered on; so other JSON files of formats, each in its way
//! NAME/OUTPUT.mp4   of the pictures that the parts have kept
//! manifest.json     hashes of all files
//! ```

use super::manifest::Manifest;
use super::names::{DESCRIPTION, MANIFEST, fault_of_name};
use crate::data::formats::films::{folder_of_pictures, path_of_film, time_of_capture};
use crate::data::formats::log::LOG;
use crate::data::formats::parts::{read_json, refused};
use crate::data::formats::writers::merged_files;
use crate::export::mcap::Log;
use crate::frames::FrameError;
use crate::output::{self, OutputError, WholeFile};
use crate::video::Film;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter, ErrorKind};
use std::path::{Path, PathBuf};
use systems::sensors::CameraOutput;

/// Folders of a part.
pub(crate) struct PartFiles {
    /// Its data set.
    pub data: PathBuf,
    /// Pictures of its films.
    pub films: PathBuf,
}

/// Tells if a file of a data set, by its path in it, is made of the run as a whole.
pub(crate) fn is_of_run(name: &str) -> bool {
    [DESCRIPTION, MANIFEST, LOG].contains(&name) || merged_files().any(|(merged, _)| merged == name)
}

/// Makes what a data set has of a run as a whole. `hashes`: of the files of single captures, which are in the folder.
///
/// # Errors
/// [`FrameError`]: what cannot be written; parts that are not of one run.
pub(crate) fn merge(
    parts: &[PartFiles],
    folder: &Path,
    mut hashes: BTreeMap<String, String>,
) -> Result<(), FrameError> {
    let mut made = vec![folder.join(DESCRIPTION)];
    let description = description(parts)?;
    write(&made[0], Ok(format!("{description:#}\n").into_bytes()))?;
    if all_have(parts, LOG)? {
        made.push(folder.join(LOG));
        merge_logs(parts, &folder.join(LOG))?;
    }
    for (name, merge) in merged_files() {
        if all_have(parts, name)? {
            let path = folder.join(name);
            let files: Vec<PathBuf> = parts.iter().map(|part| part.data.join(name)).collect();
            write(&path, Ok(merge(&files, &path)?))?;
            made.push(path);
        }
    }
    made.extend(merge_films(parts, folder, &description)?);
    hashes.extend(output::hashes_of(folder, &made)?);
    let Some(last) = parts.last() else { return Ok(()) };
    let mut manifest: Manifest = read_json(&last.data.join(MANIFEST))?;
    manifest.blake3 = hashes;
    write(&folder.join(MANIFEST), manifest.text().map(String::into_bytes).map_err(Into::into))
}

/// Tells if parts have a file that is made of the run as a whole: all of them, or none.
fn all_have(parts: &[PartFiles], name: &str) -> Result<bool, FrameError> {
    let (have, lack): (Vec<_>, Vec<_>) = parts.iter().map(|part| part.data.join(name)).partition(|path| path.is_file());
    match (have.first(), lack.first()) {
        (Some(_), Some(lack)) => Err(refused(lack, "is not there; expected it as in other parts of the run")),
        (have, _) => Ok(have.is_some()),
    }
}

fn write(path: &Path, bytes: std::io::Result<Vec<u8>>) -> Result<(), FrameError> {
    let bytes = bytes.map_err(|error| OutputError::io(path, error))?;
    output::make_folder(path.parent().unwrap_or(Path::new("")))?;
    Ok(output::write_whole(path, &bytes)?)
}

/// Description of the sensors, with the captures of all parts.
fn description(parts: &[PartFiles]) -> Result<Value, FrameError> {
    let mut whole: Option<(Value, Vec<Vec<Value>>)> = None;
    for part in parts {
        let path = part.data.join(DESCRIPTION);
        let mut described: Value = read_json(&path)?;
        let captures = take_captures(&mut described);
        match &mut whole {
            None => whole = Some((described, captures)),
            Some((first, all)) if *first == described => {
                all.iter_mut().zip(captures).for_each(|(all, more)| all.extend(more));
            }
            Some(_) => return Err(refused(&path, "the sensors are not those of the parts before")),
        }
    }
    let (mut whole, captures) = whole.unwrap_or_default();
    for (sensor, captures) in sensors_of(&mut whole).zip(captures) {
        sensor["captures"] = Value::Array(captures);
    }
    Ok(whole)
}

fn sensors_of(described: &mut Value) -> impl Iterator<Item = &mut Value> {
    described.get_mut("sensors").and_then(Value::as_array_mut).into_iter().flatten().filter(|sensor| sensor.is_object())
}

fn take_captures(described: &mut Value) -> Vec<Vec<Value>> {
    let captures = |sensor: &mut Value| match sensor["captures"].take() {
        Value::Array(captures) => captures,
        _ => Vec::new(),
    };
    sensors_of(described).map(captures).collect()
}

fn merge_logs(parts: &[PartFiles], path: &Path) -> Result<(), FrameError> {
    let mut log = Log::new(BufWriter::new(WholeFile::begin(path)?)).map_err(|error| OutputError::io(path, error))?;
    for part in parts {
        let from = part.data.join(LOG);
        let file = File::open(&from).map_err(|error| refused(&from, error))?;
        log.append_all(BufReader::new(file)).map_err(|error| match error.kind() {
            ErrorKind::InvalidData | ErrorKind::InvalidInput | ErrorKind::UnexpectedEof => refused(&from, error),
            _ => OutputError::io(path, error).into(),
        })?;
    }
    let ended = log.finish().and_then(|file| file.into_inner().map_err(|error| error.into_error()));
    Ok(ended.map_err(|error| OutputError::io(path, error))?.finish()?)
}

fn merge_films(parts: &[PartFiles], folder: &Path, description: &Value) -> Result<Vec<PathBuf>, FrameError> {
    let step_seconds = description["step_seconds"].as_f64().unwrap_or(1.0);
    let mut made = Vec::new();
    for sensor in description["sensors"].as_array().into_iter().flatten() {
        let Some(name) = sensor["name"].as_str() else { continue };
        if let Some(fault) = fault_of_name(name) {
            return Err(refused(&folder.join(DESCRIPTION), format!("sensor {name:?} {fault}")));
        }
        let every = sensor["every"].as_u64().and_then(|every| u32::try_from(every).ok()).unwrap_or(1);
        let outputs = sensor["outputs"].as_object().into_iter().flatten().map(|(output, _)| output);
        for output in outputs.filter(|output| CameraOutput::ALL.iter().any(|(known, _)| known == output)) {
            let pictures: Result<Vec<_>, _> =
                parts.iter().map(|part| pictures_in(&folder_of_pictures(&part.films, name, output))).collect();
            let mut film: Option<Film> = None;
            for path in pictures?.concat() {
                let picture = image::open(&path).map_err(|error| refused(&path, error))?.into_rgb8();
                let film = match &mut film {
                    Some(film) => film,
                    None => {
                        let path = path_of_film(folder, name, output);
                        output::make_folder(&folder.join(name))?;
                        film.insert(Film::begin(&path, picture.dimensions(), time_of_capture(step_seconds, every))?)
                    }
                };
                film.add(&picture)?;
            }
            if let Some(film) = film {
                made.push(film.finish()?);
            }
        }
    }
    Ok(made)
}

/// The pictures in a folder, by their numbers; none where it is not there.
fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>, FrameError> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let entries = entries.map_err(|error| refused(folder, error))?;
    let numbered = entries.into_iter().filter_map(|entry| {
        let path = entry.path();
        let number: u64 = path.file_stem()?.to_str()?.parse().ok()?;
        path.is_file().then_some((number, path))
    });
    let mut pictures: Vec<(u64, PathBuf)> = numbered.collect();
    pictures.sort_unstable();
    Ok(pictures.into_iter().map(|(_, path)| path).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(folder: &Path, logs: [Option<&[u8]>; 2]) -> Vec<PartFiles> {
        let part = |(number, log): (usize, Option<&[u8]>)| {
            let data = folder.join(number.to_string());
            fs::create_dir(&data).unwrap();
            fs::write(data.join(DESCRIPTION), r#"{"sensors": []}"#).unwrap();
            if let Some(log) = log {
                fs::write(data.join(LOG), log).unwrap();
            }
            PartFiles { films: data.join("films"), data }
        };
        logs.into_iter().enumerate().map(part).collect()
    }

    fn refusal(logs: [Option<&[u8]>; 2]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let parts = parts(folder.path(), logs);
        merge(&parts, &folder.path().join("whole"), BTreeMap::new()).unwrap_err().to_string()
    }

    #[test]
    fn a_log_that_one_part_lacks_is_named() {
        let mut log = Vec::new();
        Log::new(std::io::Cursor::new(&mut log)).unwrap().finish().unwrap();
        let said = refusal([Some(&log), None]);
        assert!(said.contains("1/sensors.mcap") && said.contains("other parts"), "{said}");
    }

    #[test]
    fn a_log_that_cannot_be_read_is_named_and_not_the_one_that_is_written() {
        let said = refusal([Some(b"no log"), Some(b"no log")]);
        assert!(said.contains("0/sensors.mcap"), "{said}");
    }
}
