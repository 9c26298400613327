"""After warming nothing of the core is left to compile; what earlier sources left behind goes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from vehicle_model import warm
from vehicle_model.compiled import is_warm

# What users of the package do, in their own order; prints each function that had to be compiled for it.
USE = """
import sys
import numpy as np
from vehicle_model.aircraft import load_aircraft
from vehicle_model.atmosphere import atmosphere
from vehicle_model.battery import battery_step, make_battery
from vehicle_model.earth import geodetic, make_environment
from vehicle_model.elevator_step import elevator_step
from vehicle_model.integrate import advance, observe
from vehicle_model.linearise import linearise
from vehicle_model.records import OUTPUTS
from vehicle_model.trim import trim_sweep
from vehicle_model.wind import Gust, make_wind, wind_step

aircraft = load_aircraft()
cruise, hover = trim_sweep(aircraft, [30.0, 0.0])
for hold in ("rpm", "throttle", "power", "thrust"):
    linearise(aircraft, cruise, hold)
elevator_step(aircraft, 30.0, duration=2.0)
for earth in ("flat", "round", "wgs84"):
    environment = make_environment(earth, latitude=0.8, longitude=0.1, height_ellipsoid=400.0, wind_ned=(3.0, 1.0, 0.0))
    state = hover.state.copy()
    advance(state, hover.controls, aircraft.vehicle, environment, 0.0025, 4)
    observe(state, hover.controls, aircraft.vehicle, environment, np.zeros(1, OUTPUTS), np.empty(20))
    atmosphere(geodetic(*state[:3], environment[0])[2])
    gusty = make_wind((3.0, 1.0, 0.0), roughness=0.05, gusts=[Gust(0.0, 50.0, (0.0, 0.0, 4.0))])
    wind_step(gusty, 1.0, 10.0, 20.0, 0.0025, environment)
    battery_step(make_battery(aircraft.battery), aircraft.vehicle.copy(), np.zeros(1, OUTPUTS), 0.0025)

core = [m for name, m in list(sys.modules.items()) if name.startswith("vehicle_model.")]
functions = {f for module in core for f in vars(module).values() if hasattr(f, "stats")}
loaded = [f.__name__ for f in functions if f.stats.cache_hits]
compiled = [f.__name__ for f in functions if f.stats.cache_misses]
print(len(loaded) > 5, sorted(compiled))
"""


def test_nothing_is_compiled_after_warming() -> None:
    warm.warm_up()
    assert is_warm()
    done = subprocess.run([sys.executable, "-c", USE], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == "True []"


def test_warming_a_warm_cache_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    warm.warm_up()
    warm.main()
    assert capsys.readouterr() == ("", "")


def test_caches_of_earlier_sources_go_but_the_newest_and_the_current_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = [tmp_path / f"{age:016x}" for age in range(12)]
    for age, folder in enumerate(folders):
        folder.mkdir()
        (folder / "code.nbi").touch()
        os.utime(folder, (1e9 - age, 1e9 - age))
    oldest = folders[-1]
    monkeypatch.setattr(warm, "KEPT_FOLDERS", 3)
    monkeypatch.setattr(warm, "CACHE_FOLDER", oldest)
    monkeypatch.setattr(warm, "is_warm", lambda: False)
    warm.warm_up()
    assert sorted(tmp_path.iterdir()) == [*folders[:3], oldest]
