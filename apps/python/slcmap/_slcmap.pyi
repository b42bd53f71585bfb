"""The types of what is written in C++. Docstrings are there too: help(slcmap.Map)."""
from os import PathLike
from typing import Any, Callable, Iterator, Optional, Sequence, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Path = Union[str, PathLike[str]]
_Floats = NDArray[np.float64]
_Integers = NDArray[np.int64]
_Image = NDArray[np.uint8]

__version__: str

class DataError(ValueError): ...
class ConfigError(ValueError): ...
class OutputError(OSError): ...
class FailedRunError(DataError): ...

class Camera:
    def __init__(self, width_px: int, height_px: int, intrinsics: Sequence[float],
                 camera_model: str = ..., distortion_model: str = ...,
                 coefficients: Sequence[float] = ...) -> None: ...
    width_px: int
    height_px: int
    camera_model: str
    distortion_model: str
    intrinsics: list[float]
    coefficients: list[float]
    K: _Floats
    def project(self, points: ArrayLike) -> _Floats: ...
    def unproject(self, pixels: ArrayLike) -> _Floats: ...

class Rig:
    def __init__(self, cameras: Sequence[Camera], T_imu_camera: Sequence[ArrayLike],
                 camera_time_offset_s: float = ..., imu_noise: dict[str, float] = ...,
                 right_time_offset_s: float = ..., readout_s: Sequence[float] = ...) -> None: ...
    @staticmethod
    def load(path: _Path) -> Rig: ...
    def save(self, path: _Path) -> None: ...
    cameras: list[Camera]
    T_imu_camera: _Floats
    imu_noise: dict[str, float]
    camera_time_offset_s: float
    right_time_offset_s: float
    readout_s: list[float]

class Trajectory:
    def __init__(self, stamps_ns: ArrayLike, positions: ArrayLike,
                 quaternions_wxyz: ArrayLike) -> None: ...
    @staticmethod
    def load(path: _Path) -> Trajectory: ...
    def save_tum(self, path: _Path) -> None: ...
    stamps_ns: _Integers
    positions: _Floats
    quaternions_wxyz: _Floats
    T_world_imu: _Floats
    def at(self, stamp_ns: int) -> Optional[_Floats]: ...
    def to_evo(self) -> Any: ...
    def __len__(self) -> int: ...

class Sample:
    stamp_ns: int
    left: _Image
    right: Optional[_Image]
    images: list[Optional[_Image]]

class Samples:
    def __iter__(self) -> Iterator[Sample]: ...
    def __next__(self) -> Sample: ...

class Recording:
    path: str
    form: str
    calibration: str
    rig: Rig
    stamps_ns: _Integers
    imu: dict[str, NDArray[Any]]
    truth: Optional[Trajectory]
    warnings: dict[str, int]
    def _arguments(self) -> list[str]: ...
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, index: int) -> Sample: ...
    @overload
    def __getitem__(self, index: slice) -> list[Sample]: ...
    def __iter__(self) -> Samples: ...

class State:
    stamp_ns: int
    segment: int
    T_world_imu: _Floats
    velocity_m_s: _Floats
    gyro_bias_rad_s: _Floats
    accel_bias_m_s2: _Floats

class OdometryBase:
    def __init__(self, rig: Rig, method: str, config: Optional[_Path], threads: int) -> None: ...
    def add_imu(self, stamp_ns: Union[int, NDArray[np.integer[Any]]], gyro: ArrayLike, accel: ArrayLike) -> None: ...
    def add_stereo(self, stamp_ns: int, left: NDArray[Any],
                   right: Optional[NDArray[Any]] = ...,
                   others: Sequence[NDArray[Any]] = ...) -> Optional[State]: ...
    def finish(self) -> Optional[State]: ...
    method: str
    trajectory: Trajectory
    points: _Floats
    lines: _Floats
    warnings: dict[str, int]

class Map:
    @staticmethod
    def load(folder: _Path, accept_changed: bool = ...) -> Map: ...
    complete: bool
    method: str
    warnings: dict[str, int]
    verdict: str
    trajectory: Trajectory
    keyframes: Trajectory
    rig: Rig
    lines: _Floats
    marks: _Floats
    line_ids: _Integers
    line_probability: _Floats
    line_sigma_m: _Floats
    line_deviation_rad: _Floats
    line_observations: NDArray[np.int32]
    line_axes: list[str]
    line_kinds: list[str]
    points: _Floats
    point_sigma_m: _Floats
    point_line_ids: _Integers
    dense: _Floats
    dense_normals: _Floats
    dense_grey: _Image
    dense_sigma_m: _Floats
    filled: _Floats
    filled_normals: _Floats
    occupied: _Floats
    voxel_m: float
    planes: list[dict[str, Any]]
    openings: list[dict[str, Any]]
    rooms: list[dict[str, Any]]
    walls: list[dict[str, Any]]
    pipes: list[dict[str, Any]]

class Run:
    @staticmethod
    def load(folder: _Path) -> Run: ...
    method: str
    complete: bool
    warnings: dict[str, int]
    verdict: str
    reasons: list[str]
    trajectory: Trajectory

def open(path: _Path, calibration: Optional[_Path] = ..., *, cameras: Sequence[int] = ...,
         masks: Sequence[str] = ..., pair_tolerance_s: float = ...,
         right_offset_s: float = ...) -> Recording: ...
def run_command(arguments: Sequence[str], progress: Optional[Callable[[str, float], object]],
                printed: list[str]) -> None: ...
