"""What scripts/quickstart builds is all that `cmake --install` puts down, and reads what the README promises."""
import os
import pathlib
import subprocess

from first_hour import BIN, CASES, FOLDER, check

BUILD = BIN.parent
prefix = FOLDER / "prefix"
installed = subprocess.run(["cmake", "--install", str(BUILD), "--prefix", str(prefix)], capture_output=True, text=True,
                           check=False)
check(installed.returncode == 0, f"cmake --install fails: {installed.stderr}")

# Every file that was built for it is an output of the target that quickstart builds, and of no other.
query = subprocess.run(["ninja", "-C", str(BUILD), "-t", "query", "installed"], capture_output=True, text=True, check=True)
built = {pathlib.Path(line.strip()).name for line in query.stdout.splitlines()}
binaries = [path for folder in ("bin", "lib") for path in (prefix / folder).rglob("*")
            if path.is_file() and (folder == "bin" or path.suffix in (".so", ".a"))]
check({"isohf", "isohf-experiment"} <= {path.name for path in binaries}, f"installed are {binaries}")
for path in binaries:
    check(path.name in built, f"{path.name} is installed, and scripts/quickstart does not build it")

# The installed programs find their modules: netCDF-4 among them.
if (CASES / "degrees_west.nc").exists():
    environment = {key: value for key, value in os.environ.items() if key != "ISOHF_MODULE_PATH"}
    read = subprocess.run([str(prefix / "bin" / "isohf"), "info", str(CASES / "degrees_west.nc")], capture_output=True,
                          text=True, env=environment, check=False)
    check(read.returncode == 0 and "netCDF" in read.stdout, f"{read.stdout}{read.stderr}")
