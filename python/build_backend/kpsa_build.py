"""Builds the wheel with CMake (PEP 517), and needs nothing but what the build of kpsa needs.

    pip install .                                        compiles the library and the module
    pip install . --config-settings build-folder=build   takes them from a build that is there
"""
import base64
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def _version():
    return re.search(r"project\(kpsa VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


def _metadata():
    return f"""Metadata-Version: 2.1
Name: kpsa
Version: {_version()}
Summary: A runtime for character rigs, with Key Point Subspace Acceleration
License: Apache-2.0
Requires-Python: >=3.9
Requires-Dist: numpy
"""


def _build(folder):
    configure = ["cmake", "-S", str(ROOT), "-B", str(folder)]
    if not (folder / "CMakeCache.txt").exists():
        configure += ["-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DKPSA_UNITY=ON", "-DKPSA_PROGRAM=OFF", "-DKPSA_PYTHON=ON",
                      f"-DPython_EXECUTABLE={sys.executable}"]
    subprocess.run(configure, check=True)
    subprocess.run(["cmake", "--build", str(folder), "--target", "kpsa_python"], check=True)
    return folder / "python" / "kpsa"


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    given = (config_settings or {}).get("build-folder")
    with tempfile.TemporaryDirectory() as temporary:
        package = _build(pathlib.Path(given or os.environ.get("KPSA_BUILD_FOLDER") or temporary).resolve())
        module = next(path.name for path in package.iterdir() if path.name.startswith("_kpsa."))
        python = "cp" + re.search(r"cpython-([0-9]+)", module).group(1)  # of the build, which may not be this one
        tag = f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"
        info = f"kpsa-{_version()}.dist-info"
        files = {f"kpsa/{path.name}": path.read_bytes() for path in sorted(package.iterdir()) if path.is_file()}
        files[f"{info}/METADATA"] = _metadata().encode()
        files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: kpsa\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
        files[f"{info}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
        record = "".join(f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}\n"
                         for name, data in files.items())
        files[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
        name = f"kpsa-{_version()}-{tag}.whl"
        with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
            for path, data in files.items():
                wheel.writestr(path, data)
    return name


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("kpsa is installed from its repository: pip install .")
