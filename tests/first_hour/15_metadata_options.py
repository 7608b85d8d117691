"""verify --against reads its input by the options that an archive records, and by options of an input alone; a raster
that isohf view converts lies in a folder of its own."""
import signal
import stat
import time
import zlib

from first_hour import *


def altered(archive, name, pairs):
    """The archive with other texts in its metadata: each of the same length, with right checksums."""
    content = (FOLDER / archive).read_bytes()
    start = content.index(b"{", content.index(b"isohf.json"))
    end = content.index(b"\n}\n", start) + 3
    metadata = content[start:end]
    changed = metadata
    for old, new in pairs:
        check(changed.count(old.encode()) == 1 and len(new) <= len(old), f"cannot replace {old}")
        changed = changed.replace(old.encode(), new.ljust(len(old)).encode())
    content = content.replace(metadata, changed)
    for crc_of, crc in ((metadata, changed),):
        content = content.replace(struct.pack("<L", zlib.crc32(crc_of)), struct.pack("<L", zlib.crc32(crc)))
    (FOLDER / name).write_bytes(content)
    return name


def hill(column, row):
    return 300 + column + 2 * row


raster = write_tiff("a.tif", 40, 30, hill, west=400000.0, north=5000000.0, spacing=30.0, epsg=32632)
isohf("convert", raster, "a.isohf", "-q", "--nodata", "-32768", "--registration", "area")
isohf("verify", "a.isohf", "--against", raster, "-q")
check(altered("a.isohf", "same.isohf", [('"-32768"', '"-32767"')]), "no archive")
isohf("verify", "same.isohf", "--against", raster, "-q")

secret = FOLDER / "s.toml"
secret.write_text("quiet = true\n")
# No option of the command, of its work, of another command, or that prints; nor a value that no option takes.
for key, value, names in (("quiet", "true", ["quiet"]), ("config", "s.toml", ["config"]), ("tmpdir", "/tmp/x", ["tmpdir"]),
                          ("against", "b.tif", ["against"]), ("help", "true", ["help"]), ("json", "true", ["json"]),
                          ("strict", "true", ["strict"]), ("memory", "1G", ["memory"]), ("j", "4", ["j"]),
                          ("input", "b", ["input"]), ("geoid", "../s.pgm", ["geoid", "without a folder"]),
                          ("geoid", "/s.pgm", ["geoid", "without a folder"]), ("raw", "2x2:f99", ["raw", "f99"]),
                          ("fill", "maybe", ["fill", "maybe"])):
    # One record of 40 bytes becomes another, with blanks behind it.
    name = altered("a.isohf", "b.isohf", [('"nodata": "-32768"', f'"{key}":"{value}"'.replace("/tmp/x", "/x"))]
                   if len(f'"{key}":"{value}"') <= len('"nodata": "-32768"') else
                   [('"registration": "area"', f'"{key}":"{value}"')])
    isohf("verify", name, "-q")  # it is whole
    for more in ((), ("--json",)):
        result = refuses("verify", name, "--against", raster, *more, code=1,
                         words=["b.isohf", "isohf.json", "source.options", *names])
        check("usage" not in result.out.lower(), f"{key}: prints help")
# A system that is recorded is a text, never a file's name.
(FOLDER / "k.prj").write_text("EPSG:32632")
name = altered("a.isohf", "b.isohf", [('"nodata": "-32768"', '"crs": "k.prj"')])
refuses("verify", name, "--against", raster, code=2, words=["k.prj", "PROJ does not understand it"])


# A raster is viewed through an archive in a folder whose name nobody can foresee, and that no other user can enter.
def view(script, picture):
    """Runs isohf view, `script` before it in the same process; the process, and the folder for temporary files."""
    folder = FOLDER / f"tmp-{picture}"
    folder.mkdir()
    command = f'{script}; exec "$0" view "$1" --size 64x48 --screenshot "$2"'
    process = subprocess.Popen(["bash", "-c", command, str(BIN / "isohf"), str(large), str(FOLDER / f"{picture}.png")],
                               cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               env={**os.environ, "TMPDIR": str(folder)})
    return process, folder


large = write_hgt("N44E006.hgt", 3601, lambda column, row: (column * 7 + row * 13) % 911)
victim = FOLDER / "victim"
victim.write_text("mine\n")
links = f'for e in "" .part .part.journal; do ln -s "{victim}" isohf-view-$$.isohf$e; done'
process, folder = view(links, "linked")
_, errors = process.communicate(timeout=120)
check(victim.read_text() == "mine\n", "isohf view wrote through a link that lay in the folder for temporary files")
if process.returncode == 0:
    check((FOLDER / "linked.png").exists(), "no picture")
check(all(path.is_symlink() and "-view-" in path.name for path in folder.iterdir()) and len(list(folder.iterdir())) == 3,
      f"isohf view leaves {sorted(path.name for path in folder.iterdir())}")

for number in (signal.SIGINT, signal.SIGTERM):
    process, folder = view("true", number.name)
    modes = set()
    while process.poll() is None and not modes:
        for path in folder.iterdir():
            try:
                modes.add(stat.filemode(path.stat().st_mode))
            except FileNotFoundError:
                pass
        time.sleep(0.001)
    process.send_signal(number)
    process.communicate(timeout=120)
    check(modes == {"drwx------"}, f"the folder is {modes}")
    check(process.returncode in (130, 0), f"ended with {process.returncode} by {number.name}")
    check(not list(folder.iterdir()), f"leaves {list(folder.iterdir())} when it is ended by {number.name}")
