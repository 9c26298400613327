"""Makes `tiltwing.py` beside this file: our dialect, from the message definitions that pymavlink's wheel ships.

Run by the build (setup.py) and, in a checkout, as `python sitl/mavlink/dialect/generate.py`. It imports nothing of
ours, because a build has not installed us yet.
"""

import contextlib
import io
import py_compile
import tempfile
from importlib.resources import as_file, files
from pathlib import Path

__all__ = ["DIALECT", "generate"]

DIALECT = Path(__file__).with_name("tiltwing.xml")

# What the MAVLink project changed in existing definitions after those in the wheel were written. mavgen takes neither a
# second name for a value nor a second definition of a message, so copies of the files are changed: file, old, new.
_TARGETS = """<field type="uint8_t" name="target_system">System id.</field>
      <field type="uint8_t" name="target_component">Component id.</field>"""
_TIMESYNC_END = """Timestamp of syncing component (mirrored in response).</field>
"""
PATCHES = (
    ("minimal.xml", "MAV_TYPE_VTOL_RESERVED4", "MAV_TYPE_VTOL_TILTWING"),
    ("common.xml", _TIMESYNC_END, f"{_TIMESYNC_END}      <extensions/>\n      {_TARGETS}\n"),
)


def generate(output: Path) -> Path:
    """Write the Python module of the dialect to `output` (a .py path), compile it, and return that path.

    Raises RuntimeError if the shipped definitions are not those the patches are for or, with mavgen's own words, if the
    dialect does not compile.
    """
    from pymavlink.generator import mavgen

    with as_file(files("pymavlink") / "dialects" / "v20") as shipped, tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for name in ("minimal.xml", "standard.xml", "common.xml"):
            (work / name).write_text(_patched(name, (shipped / name).read_text(encoding="utf-8")), encoding="utf-8")
        ours = work / DIALECT.name
        ours.write_bytes(DIALECT.read_bytes())
        made = work / output.name
        said = io.StringIO()
        options = mavgen.Opts(str(made), wire_protocol="2.0", language="Python3", validate=False)
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            accepted = mavgen.mavgen(options, [str(ours)])
        if not accepted or not made.is_file():
            msg = f"{DIALECT}: mavgen refused the dialect:\n{said.getvalue()}"
            raise RuntimeError(msg)
        output.write_bytes(made.read_bytes())
    # Compiled now: reading 2 MB of source costs 0.2 s at every start where Python may not write its cache.
    py_compile.compile(str(output), doraise=True)
    return output


def _patched(name: str, text: str) -> str:
    for file, old, new in PATCHES:
        if file == name:
            if text.count(old) != 1:
                msg = f"pymavlink's {name}: expected {old.strip()!r} once, found it {text.count(old)} times"
                raise RuntimeError(msg)
            text = text.replace(old, new)
    return text


if __name__ == "__main__":
    print(generate(DIALECT.with_suffix(".py")))
