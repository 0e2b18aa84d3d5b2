"""Builds the robot's firmware and the kernel as a C extension; everything else about the package is in pyproject.toml."""

import runpy
import sys
import sysconfig
from pathlib import Path

from setuptools import setup
from setuptools.command.build_ext import build_ext

FIRMWARE = Path(__file__).resolve().parent / "firmware_protocol" / "firmware"


class BuildExtension(build_ext):
    """Makes the C headers of the messages first."""

    def run(self) -> None:
        """Generate the headers, then build as usual."""
        runpy.run_path(str(FIRMWARE / "headers.py"))["make_headers"]()
        super().run()


if sysconfig.get_config_var("Py_GIL_DISABLED"):
    sys.exit("junior-hil: the emulated robot's extension needs a Python with a GIL: use another build of Python than this one")
setup(
    cffi_modules=["simdevice/build_host.py:builder"],
    cmdclass={"build_ext": BuildExtension},
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
