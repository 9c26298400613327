"""Scenario files: every key arrives, files are looked for beside it, and what is wrong is said in one line."""

from pathlib import Path

import pytest

from sitl.home import PX4_HOME
from sitl.scenario import Scenario, ScenarioError, Wind, load_scenario
from vehicle_model.wind import Gust


def written(folder: Path, text: str) -> Path:
    file = folder / "scenario.toml"
    file.write_text(text)
    return file


def test_an_empty_file_is_a_calm_start_on_the_ground_at_pxs_home(tmp_path: Path) -> None:
    assert load_scenario(written(tmp_path, "")) == Scenario()
    assert Scenario().home == PX4_HOME
    assert (Scenario().start, Scenario().earth, Scenario().wind) == ("ground", "flat", Wind())


def test_every_key_arrives_and_files_are_looked_for_beside_the_scenario(tmp_path: Path) -> None:
    for name in ("craft.toml", "survey.plan", "begin.toml"):
        (tmp_path / name).touch()
    scenario = load_scenario(
        written(
            tmp_path,
            """
            start = "begin.toml"
            home = [50, 8.5, 120, 90]
            earth = "wgs84"
            seed = 7
            aircraft = "craft.toml"
            mission = "survey.plan"
            links_enforced = true
            [wind]
            steady_ned = [3, -2, 0.5]
            roughness = 0.05
            [[wind.gusts]]
            time = 10
            length = 50
            amplitude_ned = [0, 0, -4]
            [parameters]
            MIS_TAKEOFF_ALT = 40
            [[commands]]
            at = 2
            do = "arm"
            [[commands]]
            when = "altitude:30"
            after = 1.5
            do = "transition cruise"
            """,
        )
    )
    assert scenario.start == str(tmp_path / "begin.toml")
    assert scenario.home == (50.0, 8.5, 120.0, 90.0)
    assert (scenario.earth, scenario.seed, scenario.links_enforced) == ("wgs84", 7, True)
    assert (scenario.aircraft, scenario.mission) == (tmp_path / "craft.toml", tmp_path / "survey.plan")
    assert scenario.wind == Wind((3.0, -2.0, 0.5), 0.05, (Gust(10.0, 50.0, (0.0, 0.0, -4.0)),))
    assert scenario.parameters == {"MIS_TAKEOFF_ALT": 40.0}
    timed, waiting = scenario.steps
    assert (timed.at, timed.trigger, timed.text) == (2.0, None, "arm")
    assert (waiting.at, waiting.after, waiting.text) == (None, 1.5, "transition cruise")
    assert waiting.trigger is not None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("star = 'ground'", "star: unknown key, expected one of start, home, earth"),
        ("[wind]\nsteady = [1, 2, 3]", "wind.steady: unknown key, expected one of steady_ned, roughness, gusts"),
        ("[[wind.gusts]]\nwhen = 3", "wind.gusts[0].when: unknown key, expected one of time, length, amplitude_ned"),
        ("[[wind.gusts]]\ntime = 3\nlength = 9", "wind.gusts[0].amplitude_ned: expected this key, got none"),
        (
            "[[wind.gusts]]\ntime = 3\nlength = 0\namplitude_ned = [0, 0, 1]",
            "wind: gusts[0].length: expected a length above 0 m",
        ),
        ("[wind]\nroughness = 2", "wind: roughness: expected 0 to less than 0.9144 m, got 2 m"),
        ("[[wind.gusts]]\ntime = 0\nlength = 9\namplitude_ned = [0, 0, 1]\n" * 9, "wind: gusts: expected at most 8"),
        ("wind = 3", "wind: expected `object`, got `int`"),
        ("[wind]\nsteady_ned = [1, 2]", "wind.steady_ned: expected `array` of length 3, got 2"),
        ("[wind]\nsteady_ned = [1, nan, 0]", "wind.steady_ned[1]: expected a number within +-1e+06, got nan"),
        ("home = [91, 0, 0, 0]", "home: expected a latitude within +-89.9, got 91"),
        ("earth = 'disk'", "earth: invalid enum value 'disk'"),
        ("seed = -1", "seed: expected `int` >= 0"),
        ("seed = 1.5", "seed: expected `int`, got `float`"),
        ("start = 'moon'", "start: expected ground, trim:AIRSPEED or the path of a start file, got 'moon'"),
        ("mission = 'lost.plan'", "mission: expected the path of a file, got 'lost.plan', and there is no such file"),
        ("aircraft = '.'", "aircraft: expected the path of a file, got '.', and this is a folder"),
        ("[parameters]\nMIS_TAKEOF_ALT = 3", "parameters: MIS_TAKEOF_ALT: unknown parameter, expected MIS_TAKEOFF_ALT"),
        ("[parameters]\nMIS_TAKEOFF_ALT = -3", "parameters: MIS_TAKEOFF_ALT: expected "),
        ("[[commands]]\nat = 1", "commands[0].do: expected this key, got none"),
        ("[[commands]]\nat = -1\ndo = 'arm'", "commands[0].at: expected `float` >= 0"),
        (
            "[[commands]]\nat = 1\nwhen = 'landed'\ndo = 'arm'",
            "commands[0]: expected either at, or when and after, got",
        ),
        ("[[commands]]\nat = 1\nafter = 1\ndo = 'arm'", "commands[0]: expected either at, or when and after, got both"),
        ("[[commands]]\ndo = 'arm'\n[[commands]]\ndo = 'jump'", "commands[1].do: expected one of arm, disarm, takeoff"),
        ("[[commands]]\ndo = 'transition'", "commands[0].do: expected 'transition cruise|hover', got 'transition'"),
        ("[[commands]]\ndo = 'takeoff high'", "commands[0].do: expected 'takeoff [HEIGHT]', got 'takeoff high'"),
        ("[[commands]]\ndo = 'mode fast'", "commands[0].do: expected 'mode manual|stabilized|altitude|position|hold"),
        ("[[commands]]\ndo = 'fail motor left 2'", "commands[0].do: expected a share of the thrust from 0 to 1, got 2"),
        ("[[commands]]\ndo = 'fail wing'", "commands[0].do: expected 'fail motor left|right|tail LOSS' or 'fail tilt|"),
        ("[[commands]]\ndo = 'parameter FAST 1'", "commands[0].do: FAST: unknown parameter"),
        ("[[commands]]\nwhen = 'late'\ndo = 'arm'", "commands[0].when: expected one of armed, disarmed, airborne"),
        ("[[commands]]\nwhen = 'mode:fast'\ndo = 'arm'", "commands[0].when: expected mode: and one of manual, stabil"),
        ("[[commands]]\nwhen = 'altitude:up'\ndo = 'arm'", "commands[0].when: expected a number after the colon, got"),
        ("[[commands]]\nwhen = 'waypoint:-1'\ndo = 'arm'", "commands[0].when: expected one of armed"),
        ("start = = 3", "cannot be read as TOML"),
    ],
)
def test_a_wrong_file_is_one_line_with_the_file_and_the_key(tmp_path: Path, text: str, expected: str) -> None:
    file = written(tmp_path, text)
    with pytest.raises(ScenarioError) as refusal:
        load_scenario(file)
    message = str(refusal.value)
    assert message.startswith(f"{file}: {expected}")
    assert "\n" not in message


def test_a_missing_file_is_said_with_its_name(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"no-such\.toml: cannot be read as TOML"):
        load_scenario(tmp_path / "no-such.toml")
