"""Maps buildings from the images of a stereo camera and the samples of an IMU.

    import slcmap
    result = slcmap.run("SEQ", "OUT", progress=print)       # all stages, as `slcmap run` does them
    result.trajectory.positions, result.map.lines           # numpy

    for sample in slcmap.open("SEQ"):                        # any recording that slcmap reads
        sample.stamp_ns, sample.left, sample.right

    odometry = slcmap.Odometry(rig, options={"points": {"max_points": 160}})
    odometry.add_imu(stamp_ns, gyro, accel)
    state = odometry.add_stereo(stamp_ns, left, right)

Metres, radians and seconds unless a name says otherwise; stamps are nanoseconds. T_a_b maps points
of frame b to frame a. What the program logs goes to logging.getLogger("slcmap"). Errors are
DataError and ConfigError, which are ValueErrors, and OutputError, an OSError. Functions named as
commands take the command's options as keywords: `--from 40 --no-check` is `from_=40,
no_check=True`; they give the same bytes as the program, and one runs at a time.
"""
from __future__ import annotations

import contextlib
import json
import logging
import os
import tempfile
from typing import Any, Callable, Iterator, Mapping, Optional, Union

from ._slcmap import (Camera, ConfigError, DataError, FailedRunError, Map, OdometryBase, OutputError,
                      Recording, Rig, Run, Sample, Samples, State, Trajectory, __version__, open,
                      run_command)

__all__ = ["Camera", "ConfigError", "DataError", "FailedRunError", "Map", "Odometry", "OutputError",
           "Recording", "Result", "Rig", "Run", "Sample", "Samples", "State", "Trajectory", "check",
           "command", "evaluate", "map", "odometry", "open", "run", "simulate"]

Path = Union[str, "os.PathLike[str]"]
Options = Union[Path, Mapping[str, Any], None]
Progress = Optional[Callable[[str, float], object]]


@contextlib.contextmanager
def _folder() -> Iterator[str]:
    """A folder of files that stand for arguments: errors call these by their names alone."""
    with tempfile.TemporaryDirectory(prefix="slcmap-") as folder:
        try:
            yield folder
        except (ConfigError, DataError) as error:
            raise type(error)(str(error).replace(folder + os.sep, "")) from None


def _plain(value: Any) -> Any:
    """Numbers and arrays of numpy, which json does not know."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise ConfigError(f"options: found {value!r}, expected dicts, lists, texts and numbers")


@contextlib.contextmanager
def _config(options: Options) -> Iterator[Optional[str]]:
    """The path of a YAML file that holds the options."""
    if not isinstance(options, Mapping):
        yield None if options is None else os.fspath(options)
        return
    with _folder() as folder:
        path = os.path.join(folder, "options")
        with contextlib.closing(os.fdopen(os.open(path, os.O_CREAT | os.O_WRONLY, 0o600), "w")) as file:
            json.dump(options, file, default=_plain)  # which is YAML, too
        yield path


def _words(arguments: Mapping[str, Any]) -> list[str]:
    """Keywords as a command line has them: from_=40 is --from 40, True a flag, a list one a value."""
    words: list[str] = []
    for key, value in arguments.items():
        name = "--" + key.rstrip("_").replace("_", "-")
        if value is True:
            words.append(name)
        elif value is not None and value is not False:
            values = value if isinstance(value, (list, tuple)) else [value]
            words += [f"{name}={os.fspath(v) if isinstance(v, os.PathLike) else v}" for v in values]
    return words


def _recording(recording: Union[Path, Recording]) -> list[str]:
    return recording._arguments() if isinstance(recording, Recording) else [os.fspath(recording)]


def _method(method: Optional[str]) -> list[str]:
    return [] if method is None else ["--method", method]


def command(*arguments: Path, progress: Progress = None) -> str:
    """Runs any command but `compare` and `batch` with these arguments, and returns what it prints.

    command("merge", "MAP1", "MAP2", "-o", "BUILDING"). progress(label, share) is called with what
    is under way and how far it is, in [0, 1]; what it throws, or Ctrl-C, ends the command with the
    results so far, and is thrown on.
    """
    printed: list[str] = []
    run_command([os.fspath(argument) for argument in arguments], progress, printed)
    return printed[0]


def _command(arguments: list[str], options: Options, progress: Progress) -> None:
    """What it prints is logged, as what it says."""
    printed: list[str] = []
    try:
        with _config(options) as path:
            run_command(arguments + ([] if path is None else ["--config", path]), progress, printed)
    finally:
        for line in "".join(printed).splitlines():
            logging.getLogger("slcmap").info("%s", line)


class Result:
    """What `run` wrote into a folder: run, map, export and map.html.

    Also of a run for which FailedRunError was thrown: Result("OUT").
    """

    def __init__(self, folder: Path) -> None:
        self.folder = os.fspath(folder)
        self._run: Optional[Run] = None
        self._map: Optional[Map] = None

    @property
    def run(self) -> Run:
        """What odometry found."""
        if self._run is None:
            self._run = Run.load(os.path.join(self.folder, "run"))
        return self._run

    @property
    def map(self) -> Map:
        """The map."""
        if self._map is None:
            self._map = Map.load(os.path.join(self.folder, "map"))
        return self._map

    @property
    def trajectory(self) -> Trajectory:
        """The poses, after the adjustment of all keyframes."""
        return self.map.trajectory

    def __repr__(self) -> str:
        return f"<slcmap.Result {self.folder}: {self.run!r}, {self.map!r}>"


def run(recording: Union[Path, Recording], out: Path, *, method: Optional[str] = None,
        options: Options = None, progress: Progress = None, **arguments: Any) -> Result:
    """`slcmap run`: odometry, map and export into the folder `out`.

    method: slc, structural, points-lines, points or points-mono. options: the path of a YAML file,
    or its contents as a dict: {"points": {"max_points": 160}, "mapping": {...}}.
    """
    _command(["run", *_recording(recording), "-o", os.fspath(out), *_method(method),
                  *_words(arguments)], options, progress)
    return Result(out)


def odometry(recording: Union[Path, Recording], out: Path, *, method: Optional[str] = None,
             options: Options = None, progress: Progress = None, **arguments: Any) -> Run:
    """`slcmap odometry`: writes the run folder `out`, and reads it."""
    _command(["odometry", *_recording(recording), "-o", os.fspath(out), *_method(method),
                  *_words(arguments)], options, progress)
    return Run.load(out)


def map(source: Union[Path, Recording], out: Path, *, options: Options = None,  # noqa: A001
        progress: Progress = None, **arguments: Any) -> Map:
    """`slcmap map`: of a run folder or, with poses=FILE, of a recording; writes and reads `out`."""
    _command(["map", *_recording(source), "-o", os.fspath(out), *_words(arguments)], options,
                 progress)
    return Map.load(out)


def simulate(scene: Path, out: Path, *, progress: Progress = None, **arguments: Any) -> Recording:
    """`slcmap simulate`: renders the recording `out` of a scene (YAML), and opens it."""
    _command(["simulate", os.fspath(scene), "-o", os.fspath(out), *_words(arguments)], None,
                 progress)
    return open(out)


def evaluate(truth: Union[Path, Trajectory], estimate: Union[Path, Trajectory], *,
             progress: Progress = None, **arguments: Any) -> dict[str, Any]:
    """`slcmap evaluate`: the figures of its JSON file. Trajectories, or files of them."""
    with _folder() as folder:
        paths = []
        for name, poses in (("truth", truth), ("estimate", estimate)):
            paths.append(os.path.join(folder, name) if isinstance(poses, Trajectory) else os.fspath(poses))
            if isinstance(poses, Trajectory):
                poses.save_tum(paths[-1])
        figures = os.path.join(folder, "figures.json")
        command("evaluate", "--truth", paths[0], "--estimate", paths[1], "--json", figures,
                *_words(arguments), progress=progress)
        with contextlib.closing(os.fdopen(os.open(figures, os.O_RDONLY))) as file:
            return dict(json.load(file))


def check(recording: Union[Path, Recording], *, progress: Progress = None,
          **arguments: Any) -> dict[str, Any]:
    """`slcmap check`: findings and figures, each finding with its remedy, also where it is not usable."""
    printed: list[str] = []
    try:
        run_command(["check", *_recording(recording), "--json", *_words(arguments)], progress, printed)
    except DataError:
        if not "".join(printed):
            raise
    return dict(json.loads(printed[0]))


class Odometry(OdometryBase):
    """Odometry that is fed live, without files.

    rig: a Rig, of a recording or made by hand. options: as of `run`; its sections of odometry.
    method: as of `run`; None takes that of the options, or slc.
    threads: with 2, a keyframe's state comes with the next image, and the numbers are the same.
    Throws ConfigError or DataError where options or rig are not plausible.
    """

    def __init__(self, rig: Rig, method: Optional[str] = None, options: Options = None,
                 threads: int = 1) -> None:
        with _config(options) as path:
            super().__init__(rig, method or "", path, threads)
