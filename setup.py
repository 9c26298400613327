"""Build hook: makes the MAVLink dialect before packages are collected. The rest of the build is in pyproject.toml."""

import runpy
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

DIALECT = Path(__file__).parent / "sitl" / "mavlink" / "dialect"


class BuildWithDialect(build_py):
    """`build_py` that first writes sitl/mavlink/dialect/tiltwing.py; editable installs run it too."""

    def run(self) -> None:
        """Generate, then build as usual."""
        # By path, not by import: a build has not installed the package it builds.
        runpy.run_path(str(DIALECT / "generate.py"))["generate"](DIALECT / "tiltwing.py")
        super().run()


setup(cmdclass={"build_py": BuildWithDialect})
