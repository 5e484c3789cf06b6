"""What comes with the package: links to files of the project, which builders of wheels follow; links to folders they do
not."""

import relief
from conftest import ROOT


def test_models_and_textures_are_all_there():
    for folder in ("models", "textures"):
        expected = {path.relative_to(ROOT / "assets") for path in (ROOT / "assets" / folder).rglob("*") if path.is_file()}
        own = {path.relative_to(relief.assets()) for path in (relief.assets() / folder).rglob("*") if path.is_file()}
        assert own == expected


def test_no_folder_is_a_link():
    folders = [path for path in relief.assets().rglob("*") if path.is_dir()]
    assert len(folders) >= 4 and not any(folder.is_symlink() for folder in folders)
