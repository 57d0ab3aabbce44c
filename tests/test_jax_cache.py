"""JAX's cache of compiled programs in a private folder."""

from pathlib import Path

import jax
import pytest
from jax.experimental.compilation_cache import compilation_cache

import jaxgear as jg

NAMES = (
    "jax_compilation_cache_dir",
    "jax_persistent_cache_min_compile_time_secs",
    "jax_persistent_cache_min_entry_size_bytes",
)


@pytest.fixture
def without_cache(monkeypatch, tmp_path):
    """JAX keeps nothing, and the user's cache folder is another one."""
    before = {name: getattr(jax.config, name) for name in NAMES}
    jax.config.update("jax_compilation_cache_dir", None)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    yield tmp_path
    for name, value in before.items():
        jax.config.update(name, value)
    compilation_cache.reset_cache()


def test_programs_are_kept_in_a_private_folder(without_cache):
    folder = jg.enable_cache()
    assert folder == without_cache / "jaxgear" / "jax" and folder.stat().st_mode & 0o077 == 0
    assert float(jax.jit(lambda x: 3.25 * x)(2.0)) == 6.5
    kept = {file.name for file in folder.iterdir()}
    assert any(name.startswith("jit__lambda") for name in kept)
    assert jg.enable_cache() == folder  # it stays


def test_a_folder_that_others_can_write_to_keeps_nothing(without_cache):
    (without_cache / "jaxgear").mkdir(mode=0o777)
    (without_cache / "jaxgear").chmod(0o777)
    assert jg.enable_cache() is None and jax.config.jax_compilation_cache_dir is None


def test_programs_that_jax_keeps_already_stay_where_they_are():
    assert jax.config.jax_compilation_cache_dir
    assert jg.enable_cache() == Path(jax.config.jax_compilation_cache_dir)
