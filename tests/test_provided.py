"""Tables and quantities of an installed package: its lines in a `pyproject.toml` are all that the library knows."""

import importlib.metadata
import sys

import pytest
from design_texts import loaded, text

from jaxgear.io.first_look import check_keys
from jaxgear.metrics import Quantity, Vocabulary
from jaxgear.numerics.reductions import Max
from jaxgear.provided import provided
from jaxgear.vocabulary import quantities

SOURCE = """
import jax
import jax.numpy as jnp
from jaxgear.metrics import AbstractSettings, Quantity, Vocabulary
from jaxgear.numerics import number

class Coating(AbstractSettings):
    table = "coating"
    thickness: jax.Array = number("um", low=0.0)

def _share(analysis, settings):
    return settings.thickness / jnp.max(analysis.cycle.transmission_error)

COATED = Vocabulary([Quantity("coating_share", _share, takes=Coating)])
"""
FILE = text(tail="[coating]\nthickness = 2.0\n")


@pytest.fixture
def package(tmp_path, monkeypatch):
    """An installed package with settings and a quantity of them."""
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "coated_gears.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(tmp_path / "site")
    known = importlib.metadata.entry_points
    places = {"tables": "coated_gears:Coating", "quantities": "coated_gears:COATED"}
    entries = [importlib.metadata.EntryPoint("coating", place, f"jaxgear.{group}") for group, place in places.items()]
    monkeypatch.setattr(
        importlib.metadata,
        "entry_points",
        lambda *, group: [*known(group=group), *(entry for entry in entries if entry.group == group)],
    )
    yield entries
    sys.modules.pop("coated_gears", None)


def test_a_file_may_have_its_table_and_name_its_quantity(package, tmp_path):
    whole = Vocabulary([quantities["ppte"]], further=lambda: provided("quantities")["coating"].load().values())
    assert list(whole) == ["ppte", "coating_share"]  # asked for once, at the first look-up
    assert package[0].load().table == "coating"  # a class is a table once it is imported
    design = loaded(tmp_path, FILE)
    settings = design.tables["coating"]
    assert float(settings.thickness) == 2.0
    assert settings.quantity("coating_share").settings is settings


def test_the_first_look_knows_its_table(package, tmp_path):
    (tmp_path / "gear.toml").write_text(FILE)
    check_keys(tmp_path / "gear.toml")
    package.clear()
    with pytest.raises(ValueError, match="coating: unknown key"):
        check_keys(tmp_path / "gear.toml")


def test_a_name_of_the_library_cannot_be_taken():
    taken = Quantity("ppte", lambda cycle: cycle.transmission_error, "um", reduction=Max())
    with pytest.raises(ValueError, match='quantities: "ppte" exists already'):
        Vocabulary([quantities["ppte"]], further=lambda: [taken])["ppte"]


def test_quantities_of_a_folder_are_those_of_the_vocabulary():
    """A folder of the package declares itself as a package of its own would."""
    assert "pinion_removed_volume" in quantities and "pinion_removed_volume_mm3" in quantities
