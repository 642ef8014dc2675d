"""Builds the package: by maturin with the board's extension where Rust is installed, else by setuptools without it.

Import and wheel settings need no Rust, and are installed in seconds; GYRONET_PURE=1 leaves the extension out.
"""

import os
import shutil

from setuptools import build_meta
from setuptools.build_meta import build_sdist  # noqa: F401, a hook


def _has_rust():
    return shutil.which("cargo") and not os.environ.get("GYRONET_PURE")


def _builder():
    if not _has_rust():
        return build_meta
    import maturin

    return maturin


def get_requires_for_build_wheel(config_settings=None):
    return ["maturin>=1.9,<2"] if _has_rust() else []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    return _builder().build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    return _builder().build_editable(wheel_directory, config_settings, metadata_directory)


get_requires_for_build_editable = get_requires_for_build_wheel
