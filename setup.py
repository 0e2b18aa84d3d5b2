"""Builds the robot's firmware and the kernel as a C extension; everything else about the package is in pyproject.toml."""

import runpy
import sys
import sysconfig
from pathlib import Path

import setuptools
from setuptools import setup
from setuptools.command.build_ext import build_ext

FIRMWARE = Path(__file__).resolve().parent / "firmware_protocol" / "firmware"
OLDEST_SETUPTOOLS = 80
"""As in pyproject.toml, of which an older one says something else: that it is wrong."""


class BuildExtension(build_ext):
    """Makes the C headers of the messages first."""

    def run(self) -> None:
        """Generate the headers, then build as usual."""
        runpy.run_path(str(FIRMWARE / "headers.py"))["make_headers"]()
        super().run()


if int(setuptools.__version__.partition(".")[0]) < OLDEST_SETUPTOOLS:
    old = f"setuptools {setuptools.__version__} is too old to build in place"
    sys.exit(f"junior-hil: {old}: pip install 'setuptools>={OLDEST_SETUPTOOLS}'")
if sysconfig.get_config_var("Py_GIL_DISABLED"):
    sys.exit("junior-hil: the emulated robot's extension needs a Python with a GIL: use another build of Python than this one")
setup(
    cffi_modules=["simdevice/build_host.py:builder"],
    cmdclass={"build_ext": BuildExtension},
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
