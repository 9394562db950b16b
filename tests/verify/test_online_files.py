"""The certificate of an online core on disk, as `sosmith verify --files` reads it."""

from dataclasses import replace
from pathlib import Path

import pytest
from tests.gen.designs import EXAMPLES

import sosmith
from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.specification.specification import load
from sosmith.verify.certificate_file import certificate_text, read_certificate, sealed
from sosmith.verify.graph import RejectedError


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    spec = load(EXAMPLES / "audio_lowpass.toml")
    made = design_core(replace(spec, hardware=replace(spec.hardware, architecture="online", realization="df1_ef2")))
    return generate(made, tmp_path_factory.mktemp("online"))[0].parent


@pytest.mark.slow
def test_it_is_proven_with_its_files(folder: Path) -> None:
    certificate = sosmith.Certificate.load(folder / "audio_lowpass.certificate.json")
    proof = certificate.verify(files=folder)
    assert proof.files > 2
    assert proof.hardware is None
    assert certificate.entries.claims.online is not None


@pytest.mark.slow
def test_one_without_claims_on_its_units_is_rejected(folder: Path, tmp_path: Path) -> None:
    read = read_certificate(folder / "audio_lowpass.certificate.json")
    without = read.model_copy(update={"claims": read.claims.model_copy(update={"online": None})})
    path = tmp_path / "other.certificate.json"
    path.write_text(certificate_text(sealed(without)), encoding="utf-8")
    with pytest.raises(RejectedError, match=r"^architecture of the item must not be online, as in the certificate$"):
        sosmith.Certificate.load(path).verify(files=folder)
