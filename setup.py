# Builds the compiled part with CMake, and puts the bundled scenes beside it. What does not change is in pyproject.toml.
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent


class CMakeBuild(build_ext):
    def build_extension(self, extension):
        package = Path(self.get_ext_fullpath(extension.name)).resolve().parent
        # A build folder of this tree that is there already may be named, which saves the minutes of another one.
        named = os.environ.get("TOUCHSTONE_BUILD_FOLDER")
        build = Path(named or ROOT / "build/python").resolve()
        if not shutil.which("cmake"):
            sys.exit("touchstone is built with CMake, which is missing: run tools/setup first")
        if not named:
            subprocess.run(
                ["cmake", "--preset", "release", "-B", build, f"-DPython_EXECUTABLE={sys.executable}"], check=True, cwd=ROOT
            )
        subprocess.run(["cmake", "--build", build, "--target", "touchstone_python"], check=True)
        package.mkdir(parents=True, exist_ok=True)
        for module in [*(build / "python/touchstone").glob("_core.*.so"), build / "python/touchstone/_build.py"]:
            shutil.copy(module, package)
        scenes = package / "scenes"
        scenes.mkdir(exist_ok=True)
        for scene in (build / "scenes").iterdir():
            if scene.suffix in (".glb", ".gltf", ".bin", ".png", ".jpg"):
                shutil.copy(scene, scenes)


version = re.search(r"project\(touchstone VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
setup(version=version, ext_modules=[Extension("touchstone._core", [])], cmdclass={"build_ext": CMakeBuild})
