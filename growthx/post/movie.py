"""Movies of a run, drawn from the states that it has left in its folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.checks import check_picture, require_kind, require_name, require_number, require_path
from growthx.common.errors import GrowthxError, InputError, OutputError, raise_on_all
from growthx.post.colour_bars import COLOUR_MAP, RESTING_COLOUR, Scale, add_colour_bars, font
from growthx.post.colour_bars import WIDTH as BAR_WIDTH
from growthx.post.display import display

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks

MOVIES = (".gif", ".mp4", ".ogv")
PROGRAMS = ("imageio", "imageio_ffmpeg")  # which .mp4 needs
LONGER = 800  # pixels, of the longer side of a body
TITLE = 60  # pixels, above it
SAMPLES = 5  # pictures whose colours all pictures of a .gif have
BORDER = 20  # pixels, around both
BLOCK = 16  # pixels, of what video is made of
WHITE = 250  # and above, of 255: the background, which a choice of colours may grey
LIGHT: dict[str, Any] = {"ambient": 0.75, "diffuse": 0.35}  # most of it from all around: colours are those of the bar
TILT = (0.35, 0.25)  # of the eye that looks at a cut, to the side and up
END = 1.5  # seconds for which the last state stays


def movie(
    folder: str | os.PathLike[str],
    path: str | os.PathLike[str] | None = None,
    *,
    field: str = "density",
    title: str = "",
    per_second: float = 8.0,
    magnification: float = 1.0,
    comm: MPI.Intracomm = MPI.COMM_WORLD,
) -> Path:
    """Draw the states in the folder of a run, one after another, and save them as a movie (collective); its file.

    folder: of `solve(…, out=…)` with `every`, `times` or `frames`; of a run that still goes on or was killed, too.
    path: the file, whose suffix says the format (see `MOVIES`); default: the folder's name with .gif, beside it, and
    with a number where that is there.
    field: of those in the files, of a vector its length.  title: of the colour bar; default: the field.
    per_second: states that are shown in a second.  magnification: of the displacement.

    All pictures have one range of colours and one scale, and their time above.  What does not grow is grey.  A body in
    space is cut in its middle, across its thinnest extent, to show what is inside.
    Raises InputError, before anything is drawn, for a folder without a series, a field that is not there and a movie
    that could not be written, OutputError if the disk does not take it.

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0, out="run", frames=3)
        >>> gx.plots.movie("run").name
        'run.gif'
    """
    require_path(folder, "the folder of a run")
    require_name(field, "the field of a movie")
    require_kind(title, str, "the title of a movie", "a text")
    require_number(per_second, "the number of states in a second of a movie", "a positive number", lambda n: n > 0)
    require_number(magnification, "the magnification of the displacement", "a finite number", lambda _: True)
    file = comm.bcast(_beside(Path(folder))) if path is None else path
    check_movie(file, comm)
    _on_first_rank(comm, Path(file), lambda: _film(Path(folder), Path(file), field, title, per_second, magnification))
    return Path(file)


def _beside(folder: Path) -> Path:
    """A file beside the folder that is not there yet."""
    place, count = folder.absolute(), 1
    place = place.parent if place.name in ("", "..") else place
    file = place.with_name(f"{place.name}.gif")
    while file.exists():
        count += 1
        file = place.with_name(f"{place.name}-{count}.gif")
    with suppress(ValueError):
        return file.relative_to(Path.cwd())
    return file


def check_movie(path: Any, comm: MPI.Comm) -> None:
    """Refuse, on all ranks, a movie that could not be written, also for want of a program (collective)."""
    check_picture(path, MOVIES, comm)
    file = Path(path)
    if file.suffix == ".mp4" and not all(map(find_spec, PROGRAMS)):
        raise InputError(
            f"the movie {file} needs imageio with its plugin imageio-ffmpeg, which are not both installed: a .gif or "
            ".ogv would be right"
        )


def _on_first_rank(comm: MPI.Intracomm, file: Path, draw: Callable[[], None]) -> None:
    """Draw on rank 0; an error there is one on all ranks."""
    trouble: dict[type[GrowthxError], str] = {}
    failure = None
    if comm.rank == 0:
        try:
            draw()
        except GrowthxError as error:
            trouble[InputError if isinstance(error, InputError) else GrowthxError] = str(error)
        except OSError as error:
            reason = error.strerror or str(error)
            trouble[OutputError] = f"the movie {file} cannot be written ({reason}): another folder would be right"
        except Exception as error:  # the other ranks must hear of it whatever it is
            failure = error
    for kind in (InputError, OutputError, GrowthxError):
        raise_on_all(comm, trouble.get(kind, ""), kind)
    if comm.bcast(failure is not None):
        raise failure or GrowthxError(f"the movie {file} could not be drawn")


@dataclass(frozen=True)
class _States:
    """A body and what becomes of it: times, displacements (points, 3) and values of its points or cells."""

    body: Any
    times: list[float]
    moves: list[Floats]
    values: list[Floats]

    @property
    def flat(self) -> bool:
        """Whether the body is a plane one."""
        return bool(np.ptp(self.body.points[:, 2]) == 0)

    def deformed(self, number: int, magnification: float, name: str) -> Any:
        """The body at a time, with its values under a name."""
        shape = self.body.copy(deep=True)
        shape.clear_data()
        places = shape.point_data if len(self.values[number]) == shape.n_points else shape.cell_data
        places[name] = self.values[number]
        shape.point_data["move"] = magnification * self.moves[number]
        if not self.flat:
            shape = shape.clip(normal=np.eye(3)[self.thin], origin=self.body.center, invert=True)
        shape.points = np.asarray(shape.points) + shape.point_data["move"]
        return shape

    def outline(self) -> Any:
        """The border of a plane body at rest."""
        whole = self.body.extract_surface(nonlinear_subdivision=2).clean(tolerance=1e-6)
        return whole.extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False)

    @property
    def thin(self) -> int:
        """The axis of the thinnest extent."""
        return int(np.argmin(np.ptp(self.body.points, axis=0)))

    @property
    def long(self) -> int:
        """The axis of the longest extent."""
        return int(np.argmax(np.ptp(self.body.points, axis=0)))

    def bounds(self, magnification: float) -> Floats:
        """Lowest and highest places of all times, (2, 3)."""
        shapes = [np.asarray(self.body.points), *(self.body.points + magnification * move for move in self.moves)]
        return np.array(
            [np.min([s.min(axis=0) for s in shapes], axis=0), np.max([s.max(axis=0) for s in shapes], axis=0)]
        )

    @property
    def rests(self) -> bool:
        """Whether some of the body does not grow."""
        return bool(np.isnan(self.values[0]).any())

    @cached_property
    def limits(self) -> tuple[float, float]:
        """Range of the values of all times."""
        return float(min(map(np.nanmin, self.values))), float(max(map(np.nanmax, self.values)))


def _film(folder: Path, file: Path, field: str, title: str, per_second: float, magnification: float) -> None:
    states = _read(folder, field)
    with display():
        _save(file, list(_pictures(states, title or field.replace("_", " "), magnification)), per_second)


def _read(folder: Path, field: str) -> _States:
    """The states in a folder, raw where that file knows the field."""
    known: set[str] = set()
    for name in ("raw", "fields", "points"):
        for time_file in (folder / f"{name}.pvd", folder / f"{name}.vtkhdf"):
            if not time_file.is_file():
                continue
            times, at = _opened(time_file)
            first = at(times[0])
            known |= {*first.point_data, *first.cell_data}
            if field in (*first.point_data, *first.cell_data):
                _check_series(folder, times)
                return _states(times, at, field)
    if not known:
        raise InputError(
            f"there are no states of a run in {folder}: the folder of one with --out and --frames N would be right"
        )
    raise InputError(f"there is no field '{field}' in {folder}: one of {', '.join(sorted(known))} would be right")


def _check_series(folder: Path, times: list[float]) -> None:
    if len(times) < 2:
        raise InputError(
            f"there is one state in {folder}, at t = {times[0]:g}: a run with --every K, --times A,B,C or --frames N "
            "would be right, which leaves more"
        )


def _opened(file: Path) -> tuple[list[float], Callable[[float], Any]]:
    """The times in a file, and what reads the body at one of them."""
    import pyvista

    if file.suffix == ".pvd":
        reader = pyvista.get_reader(str(file))

        def at(time: float) -> Any:
            reader.set_active_time_value(time)
            return reader.read()[0]

        return list(reader.time_values), at
    from vtkmodules.vtkIOHDF import vtkHDFReader

    source = vtkHDFReader()
    source.SetFileName(str(file))
    source.UpdateInformation()
    found, key = source.GetOutputInformation(0), source.GetExecutive().TIME_STEPS()

    def read(time: float) -> Any:
        source.UpdateTimeStep(time)
        return pyvista.wrap(source.GetOutput())

    return [found.Get(key, number) for number in range(found.Length(key))], read


def _states(times: list[float], at: Callable[[float], Any], field: str) -> _States:
    moves, values, body = [], [], None
    for time in times:
        found = at(time)
        body = found.copy(deep=True) if body is None else body
        moves.append(np.array(found.point_data["displacement"]))
        in_cells = field in found.cell_data
        own = np.array((found.cell_data if in_cells else found.point_data)[field], dtype=float)
        own = np.linalg.norm(own, axis=1) if own.ndim > 1 else own
        if "grows" in found.cell_data:
            rests = np.asarray(found.cell_data["grows"]) == 0
            own[rests if in_cells else _points_at_rest(found, rests)] = np.nan
        values.append(own)
    return _States(body, times, moves, values)


def _points_at_rest(body: Any, rests: Marks) -> Marks:
    """The points that no cell has that grows."""
    corners = np.asarray(body.cells).reshape(body.n_cells, -1)[:, 1:]
    found = np.ones(body.n_points, dtype=bool)
    found[corners[~rests]] = False
    return found


def _pictures(states: _States, title: str, magnification: float) -> Iterator[Any]:
    """A picture of each state, (height, width, 3)."""
    low, high = states.bounds(magnification)
    across, up = (0, 1) if states.flat else _sides(states)
    extent = (high - low)[[across, up]]
    shown = np.maximum(np.round(LONGER * extent / extent.max()), LONGER // 3).astype(int)
    width = _in_blocks(shown[0] + BAR_WIDTH) - BAR_WIDTH
    height = _in_blocks(shown[1] + TITLE)
    half = 0.5 * height * float((extent / shown).max())  # of the height that is seen (length)
    digits = int(np.clip(np.ceil(-np.log10(np.diff(states.times).min()) - 1e-9), 0, 6))
    outline = states.outline()
    for number, time in enumerate(states.times):
        body = states.deformed(number, magnification, title)
        with _plotter(width, height) as plotter:
            actor = plotter.add_mesh(
                body,
                scalars=title,
                cmap=COLOUR_MAP,
                clim=states.limits,
                nan_color=RESTING_COLOUR,
                show_scalar_bar=False,
                **({"lighting": False} if states.flat else LIGHT),
            )
            if states.flat:
                plotter.add_mesh(outline, color="grey", line_width=1.5, lighting=False)
            text = {"color": "black", "font_size": 16, "font_file": font()}
            plotter.add_text(f"t = {time:.{digits}f}", position=(20, height - TITLE + 5), **text)
            _look(plotter, states, low, high, half, TITLE / height)
            plotter.subplot(0, 1)
            add_colour_bars(plotter, actor.mapper, [Scale(title, *states.limits)], states.rests)
            yield np.array(plotter.screenshot(return_img=True))


@contextmanager
def _plotter(width: int, height: int) -> Iterator[Any]:
    """What draws a picture so large, and a colour bar beside it."""
    import pyvista

    layout = {"shape": (1, 2), "col_weights": [width, BAR_WIDTH], "border": False}
    # Closed before the display goes, whatever happens in between: else it takes the process with it.
    with closing(pyvista.Plotter(off_screen=True, window_size=(width + BAR_WIDTH, height), **layout)) as plotter:
        plotter.set_background("white", all_renderers=True)
        plotter.subplot(0, 0)
        yield plotter


def _in_blocks(side: int) -> int:
    """A side of a picture (pixels) with a border, in whole blocks of video."""
    return int(-(-(side + BORDER) // BLOCK) * BLOCK)


def _sides(states: _States) -> tuple[int, int]:
    """The axes that go across and up in a picture of a body in space."""
    return 3 - states.thin - states.long, states.long


def _look(plotter: Any, states: _States, low: Floats, high: Floats, half: float, title: float) -> None:
    """Put the eye where all states are seen alike; half: of the height that is seen (length); title: share of it."""
    centre, far = (low + high) / 2, 4 * float(np.linalg.norm(high - low))
    if states.flat:
        plotter.view_xy()
        direction = np.array([0.0, 0.0, 1.0])
    else:
        across, up = _sides(states)
        direction = np.eye(3)[states.thin] + TILT[0] * np.eye(3)[across] + TILT[1] * np.eye(3)[up]
        half *= 1.35  # for what the tilt makes longer
        plotter.camera.up = tuple(np.eye(3)[up])
        plotter.enable_lightkit()
    centre = centre + title * half * np.eye(3)[1 if states.flat else up]
    plotter.enable_parallel_projection()
    plotter.camera.focal_point = tuple(centre)
    plotter.camera.position = tuple(centre + far * direction)
    plotter.camera.parallel_scale = half
    plotter.renderer.reset_camera_clipping_range()


def _save(file: Path, pictures: list[Any], per_second: float) -> None:
    {".gif": _save_gif, ".mp4": _save_mp4, ".ogv": _save_ogv}[file.suffix](file, pictures, per_second)


def _save_gif(file: Path, pictures: list[Any], per_second: float) -> None:
    """All pictures in the colours that some of them have together: what stays the same must not flicker."""
    from PIL import Image

    chosen = np.unique(np.linspace(0, len(pictures) - 1, SAMPLES).round().astype(int))
    colours = Image.fromarray(np.concatenate([pictures[number] for number in chosen])).quantize(
        256, method=Image.Quantize.MAXCOVERAGE
    )
    entries = np.array(colours.getpalette())
    colours.putpalette(bytes(np.where(entries >= WHITE, 255, entries).astype(np.uint8)))
    first, *others = (Image.fromarray(each).quantize(palette=colours, dither=Image.Dither.NONE) for each in pictures)
    durations = [round(1000 / per_second)] * len(others) + [round(1000 * END)]
    first.save(file, save_all=True, append_images=others, duration=durations, loop=0, optimize=False)


def _save_mp4(file: Path, pictures: list[Any], per_second: float) -> None:
    from imageio import v2

    v2.mimwrite(file, _with_end(pictures, per_second), fps=per_second)


def _save_ogv(file: Path, pictures: list[Any], per_second: float) -> None:
    import pyvista
    from vtkmodules.vtkIOOggTheora import vtkOggTheoraWriter

    writer = vtkOggTheoraWriter()
    writer.SetFileName(str(file))
    writer.SetRate(max(1, round(per_second)))
    for number, picture in enumerate(_with_end(pictures, per_second)):
        height, width = picture.shape[:2]
        image = pyvista.ImageData(dimensions=(width, height, 1))
        image.point_data["picture"] = picture[::-1].reshape(-1, 3)
        writer.SetInputData(image)
        if number == 0:
            writer.Start()
        writer.Write()
    writer.End()
    if not file.is_file() or writer.GetError():
        raise OSError(0, "VTK could not write it")


def _with_end(pictures: list[Any], per_second: float) -> list[Any]:
    """The pictures, the last of them for as long as it stays."""
    return pictures + pictures[-1:] * round(END * per_second)
