"""A user's own model file, and all the files that it refers to."""

from pathlib import Path

import pytest

from mjspace.scenario.model_source import is_own, read_source, source_of
from mjspace.scenario.trust import CommandLineText, Trust

MAIN = """<mujoco>
  <compiler meshdir="meshes" texturedir="looks"/>
  <include file="more/common.xml"/>
  <asset>
    <mesh name="a" file="deep/a.stl"/>
    <texture name="t" type="2d" file="t.png"/>
    <texture name="c" type="cube" fileright="r.png" fileleft="l.png"/>
    <model name="arm" file="parts/arm.xml"/>
  </asset>
  <worldbody/>
</mujoco>"""
FILES = {
    "craft.xml": MAIN,
    "more/common.xml": '<mujoco><asset><hfield name="h" file="h.bin"/></asset></mujoco>',
    "meshes/deep/a.stl": "a",
    "more/h.bin": "h",
    "looks/t.png": "t",
    "looks/r.png": "r",
    "looks/l.png": "l",
    "parts/arm.xml": '<mujoco><asset><mesh name="b" file="b.obj"/></asset></mujoco>',
    "parts/b.obj": "b",
}


INCLUDES = '<mujoco><include file="x.xml"/></mujoco>'


def write(folder: Path, files: dict[str, str] = FILES) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def test_every_file_that_it_refers_to_comes_with_it(tmp_path: Path) -> None:
    write(tmp_path / "models")
    found = read_source("models/craft.xml", Trust(tmp_path))
    assert found.main == "craft.xml"
    assert found.name == "models/craft.xml"
    assert {name: content.decode() for name, content in found.files.items()} == FILES


def test_files_of_a_urdf_are_looked_up_without_their_folders(tmp_path: Path) -> None:
    visual = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
    robot = '<robot name="r"><link name="bus">{}</link></robot>'
    write(tmp_path, {"a.urdf": robot.format(visual.format("far/away/a.stl")), "a.stl": "a"})
    assert set(read_source("a.urdf", Trust(tmp_path)).files) == {"a.urdf", "a.stl"}
    write(tmp_path, {"b.urdf": robot.format(visual.format("package://x/a.stl"))})
    with pytest.raises(ValueError, match=r"'package://x/a\.stl' is for ROS"):
        read_source("b.urdf", Trust(tmp_path))
    # MuJoCo does without what is only drawn, and without another simulator's plugins.
    text = robot.format(visual.format("package://x/b.stl")).replace("collision", "visual")
    text = text.replace("</robot>", '<plugin filename="libx.so"/></robot>')
    write(tmp_path, {"c.urdf": text})
    assert set(read_source("c.urdf", Trust(tmp_path)).files) == {"c.urdf"}


@pytest.mark.parametrize("file", ["../secret.stl", "/etc/passwd"])
def test_files_outside_the_folder_need_trust(file: str, tmp_path: Path) -> None:
    folder = tmp_path / "inner"
    text = f'<mujoco><asset><mesh file="{file}"/></asset></mujoco>'
    write(folder, {"craft.xml": text})
    write(tmp_path, {"secret.stl": "s"})
    with pytest.raises(ValueError, match="is outside the scenario's folder: --trust allows that"):
        read_source("craft.xml", Trust(folder))
    for trusted in (
        read_source("craft.xml", Trust(folder, everything=True)),
        read_source(CommandLineText("craft.xml"), Trust(folder)),
    ):
        assert set(trusted.files) == {"craft.xml", f"outside/{Path(file).name}"}
        again = source_of("model/craft.xml", trusted.files.get)
        assert again.files == trusted.files


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, "no file 'craft.xml'"),
        ({"craft.xml": "<mujoco>"}, "craft.xml is no XML: no element found"),
        ({"craft.xml": INCLUDES}, r"no file 'x.xml' \(named in cr"),
        (
            {"craft.xml": '<mujoco><include file="x.xml"/></mujoco>', "x.xml": "<"},
            "x.xml is no XML",
        ),
    ],
)
def test_what_is_missing_is_named(files: dict[str, str], message: str, tmp_path: Path) -> None:
    write(tmp_path, files)
    with pytest.raises(ValueError, match=message):
        read_source("craft.xml", Trust(tmp_path))


def test_a_model_that_includes_itself_ends(tmp_path: Path) -> None:
    write(tmp_path, {"craft.xml": '<mujoco><include file="craft.xml"/></mujoco>'})
    assert set(read_source("craft.xml", Trust(tmp_path)).files) == {"craft.xml"}


def test_what_names_a_file_of_ones_own() -> None:
    own = ["a.xml", "x/a.urdf", "a.mjb", "a.py:build"]
    assert [name for name in [*own, "lander", "satellite_3rw", "a.toml"] if is_own(name)] == own
