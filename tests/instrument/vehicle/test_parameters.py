"""The file of parameters: what it holds, and the sentence with which each slip is refused."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sosmith.instrument.vehicle.parameters import LABELS, built_in, built_in_text, load, parse
from sosmith.instrument.vehicle.wheel_rail_contact import GRAVITY
from sosmith.model.errors import SpecificationError

RIGHT = built_in_text()
LOAD = 'source = "[assumed] dry rail"'


def changed(old: str, new: str) -> str:
    """Return the built-in file with one change."""
    text, count = re.subn(old, lambda _: new, RIGHT, count=1)
    assert count == 1
    return text


def refusal(text: str) -> str:
    with pytest.raises(SpecificationError) as caught:
        parse(text, "loco.toml")
    return str(caught.value)


def test_the_built_in_locomotive_is_a_six_axle_one_of_23_tonnes_an_axle() -> None:
    given = built_in()
    assert given.total_mass == 138_000
    assert given.total_mass / 6 == 23_000
    assert given.layout.outer_axle_spacing == 2.25
    assert given.contact.shear_modulus == pytest.approx(2.1e11 / (2 * 1.27), rel=1e-3)
    assert given.body.mass * GRAVITY / 4 / given.secondary.vertical_stiffness == pytest.approx(0.132, abs=5e-4)


def test_every_number_names_its_source() -> None:
    sources = built_in().sources
    assert len(sources) == RIGHT.count("source = ")
    assert all(source.startswith(LABELS) and source.split("] ")[1] for source in sources.values())
    assert sources["track.radius"].startswith("[assumed] to the left. The paper gives none")


def test_a_file_is_read_as_the_text(tmp_path: Path) -> None:
    path = tmp_path / "loco.toml"
    path.write_text("\ufeff" + changed(r"value = 4000\.0", "value = 4100"), encoding="utf-8")
    assert load(path).wheelset.mass == 4100.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            RIGHT.replace("\nfriction = ", "\n# friction = "),
            "loco.toml: contact must have the key friction, not leave it out",
        ),
        (
            changed("centre_height", "center_height"),
            "loco.toml: frame must only have the keys mass, yaw_inertia, roll_inertia, pitch_inertia, centre_height, "
            "not 'center_height' (did you mean centre_height?)",
        ),
        (
            changed(r"\[sensor\]", "[sensors]"),
            "loco.toml must only have the keys layout, wheelset, contact, frame, body, primary, secondary, sensor, "
            "track, irregularities, not 'sensors' (did you mean sensor?)",
        ),
        (
            changed(r'value = 4000\.0, unit = "kg"', 'value = 4.0, unit = "t"'),
            "loco.toml: wheelset.mass must be in the unit 'kg', not 't'",
        ),
        (
            changed(r'\{ value = 0\.3, unit = "1", ' + re.escape(LOAD) + r" \}", "0.3"),
            'loco.toml: contact.friction must be { value = ..., unit = "1", source = "..." }, not 0.3',
        ),
        (
            changed(r"value = 0\.3,", "value = -0.3,"),
            "loco.toml: contact.friction must be a number of more than 0 and less than 1e+12, not -0.3",
        ),
        (
            changed(r"value = 0\.3,", "value = 0.0,"),
            "loco.toml: contact.friction must be a number of more than 0 and less than 1e+12, not 0.0",
        ),
        (
            changed(r"value = 0\.15,", "value = 1.0,"),
            "loco.toml: wheelset.conicity must be a number of more than 0 and less than 1, not 1.0",
        ),
        (
            changed(r"value = 0\.09,", "value = nan,"),
            "loco.toml: track.cant must be a number of 0 or more and less than 0.3, not nan",
        ),
        (
            changed(r"value = 0\.09,", 'value = "90 mm",'),
            "loco.toml: track.cant must be a number of 0 or more and less than 0.3, not '90 mm'",
        ),
        (
            changed(r"value = 0\.09,", "value = true,"),
            "loco.toml: track.cant must be a number of 0 or more and less than 0.3, not True",
        ),
        (
            changed(r"\[assumed\] dry rail", "dry rail"),
            "loco.toml: contact.friction must have a source that begins with [published] or [paper] or [from memory] "
            "or [derived] or [assumed], not 'dry rail'",
        ),
        (
            changed(r"bogie_distance = \{ value = 11\.6", "bogie_distance = { value = 4.25"),
            "loco.toml: layout.bogie_distance must be more than the wheelbase of a bogie, 4.25 m, not 4.25",
        ),
        (
            changed(r"radius = \{ value = 350\.0", "radius = { value = 90.0"),
            "loco.toml: track.radius must be at least ten times layout.bogie_distance for small angles, not 90",
        ),
        (
            changed(r"shortest_wavelength = \{ value = 0\.5", "shortest_wavelength = { value = 100"),
            "loco.toml: irregularities.shortest_wavelength must be less than longest_wavelength, not 100",
        ),
        ("body = 3\n" + RIGHT.split("[body]")[0] + "[primary]" + RIGHT.split("[primary]")[1],
         "loco.toml: body must be a table, not 3"),
    ],
)  # fmt: skip
def test_slips_are_refused(text: str, message: str) -> None:
    assert refusal(text) == message


def test_broken_text_is_refused() -> None:
    assert refusal("[layout").startswith("loco.toml: line 1 must be valid TOML, not a syntax error: ")
    for text in ("a = " + 5000 * "[", "a = " + 5000 * "1"):
        assert refusal(text) == (
            "loco.toml: the file of parameters must be TOML within reason, "
            "not lists some hundred deep or a number too long to read"
        )


def test_what_is_no_readable_text_is_refused(tmp_path: Path) -> None:
    missing = tmp_path / "none.toml"
    with pytest.raises(
        SpecificationError,
        match=r"none.toml: the file of parameters must be a readable file, not: no such file or directory$",
    ):
        load(missing)
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b"# \xe9")
    with pytest.raises(SpecificationError, match=r"latin.toml: line 1 must be UTF-8 text, not the byte 0xe9$"):
        load(latin)
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * 65_537)
    with pytest.raises(
        SpecificationError, match=r"large.toml: the file of parameters must be at most 65536 bytes, not longer$"
    ):
        load(large)
