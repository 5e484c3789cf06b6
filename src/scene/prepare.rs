//! Files of scenes, read and checked: everything that can fail.

use super::check;
use super::error::SceneError;
use super::format::scene::Scene;
use super::prepared::{Content, Prepared};
use super::read::custom_fields::{self, SceneFields};
use super::read::items::Items;
use super::read::overrides::Overrides;
use super::read::rigs::is_rig;
use super::read::{files, origin, rigs};
use super::text::file::{placed, problem, read_text, slip_problem};
use super::text::parse::parse;
use super::vehicle_types;
use crate::import;
use crate::problem::Problem;
use std::path::Path;
use systems::assets::Library;
use systems::space::origin::Origin;

/// A file that is a model as a whole scene.
pub fn is_model(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"))
}

/// Reads and checks a scene, or a model as one. What it needs joins the library.
pub fn prepare(
    path: &Path,
    fields: &SceneFields,
    overrides: &Overrides,
    library: &mut Library,
) -> Result<Prepared, SceneError> {
    if is_model(path) {
        if !overrides.is_empty() {
            let message = "expected a scene (.ron): a model has no clock, geo_origin or environment of its own";
            return Err(problem(path, None, message).into());
        }
        let model = import::load_model(path, library).map_err(|error| import_problem(path, error.into()))?;
        let warnings = model.warnings.iter().map(ToString::to_string).collect();
        let (content, files) = (Content::Model(model), vec![path.to_owned()]);
        return Ok(Prepared { content, origin: Origin::default(), warnings, doubts: Vec::new(), files });
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron")) {
        return prepare_scene(path, fields, overrides, library);
    }
    Err(problem(path, None, "expected a scene (.ron) or a model (.gltf, .glb)").into())
}

fn prepare_scene(
    path: &Path,
    fields: &SceneFields,
    overrides: &Overrides,
    library: &mut Library,
) -> Result<Prepared, SceneError> {
    if is_rig(path) {
        return Err(problem(path, None, "expected a scene, found a rig, which entities of scenes take by `rig`").into());
    }
    let text = read_text(path)?;
    let mut scene = parse::<Scene>(&text).map_err(|slip| slip_problem(path, slip))?;
    overrides.apply(&mut scene);
    let mut faults = custom_fields::read(&mut scene, fields, &text).map_err(|slip| slip_problem(path, slip))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let (rigs, mut of_rigs) = rigs::read(&scene, fields, folder);
    scene.rigs = rigs;
    faults.append(&mut of_rigs);
    let (files, mut of_files) = files::read(&scene, folder, library);
    faults.append(&mut of_files);
    faults.extend(check::scene::faults(&scene, &files));
    faults.extend(check::rigs::faults(&scene, &files));
    let mut vehicles = vehicle_types::read_types(&scene, folder, library, &mut faults);
    if !faults.is_empty() {
        return Err(SceneError { problems: placed(faults, path, &text) });
    }
    let mut warnings = files.warnings(&scene);
    warnings.append(&mut vehicles.warnings);
    let doubts = files.unknown_classes(&scene);
    warnings.extend(check::names::warnings(&scene, &text));
    let (origin, mut of_places) = origin::move_to_origin(&mut scene);
    warnings.append(&mut of_places);
    let items = Items::new(&scene, &files, library);
    let mut named = vec![path.to_owned()];
    named.extend(files::named(&scene, folder));
    named.append(&mut vehicles.files);
    named.extend(scene.rigs.files());
    let content = Content::Scene(Box::new(scene), items, vehicles.types);
    Ok(Prepared { content, origin: Origin(origin), warnings, doubts, files: named })
}

/// The import's problem with a model as the scene's.
pub fn import_problem(path: &Path, problem: Problem) -> Problem {
    if problem.path == path {
        return problem;
    }
    let place = format!("{}: {}", problem.path.display(), problem.place);
    Problem { path: path.into(), place, ..problem }
}
