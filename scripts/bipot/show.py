"""Draw a bipot result: pictures and an animation, or a page with all of it, or a view to turn.

The command `bipot-show` of an installed package, and scripts/show of a clone.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

try:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import animation

    from bipot.drawing.interactive import open_window
    from bipot.drawing.style import save
    from bipot.page import write_page
    from bipot.pictures import COMPONENTS, NAMES, Look, animate, has_bodies, pictures_of, plane_of
    from bipot.result import Result, ResultError
except ImportError as error:
    sys.exit(
        f"show: {error}; pip install matplotlib, or on Debian:"
        " apt-get install python3-numpy python3-h5py python3-matplotlib"
        f" (this is {sys.executable})"
    )

POINTS = 201  # of a path


def names_of_pictures(words):
    """Return the names in a list of pictures."""
    names = words.split(",")
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        raise argparse.ArgumentTypeError(f"unknown picture '{unknown[0]}': {', '.join(NAMES)}")
    return names


def places(words):
    """Return the places (P, 3) that are named, for argparse."""
    try:
        found = [[float(x) for x in place.split(",")] for place in words.split(":")]
    except ValueError:
        found = []
    if len(found) < 2 or any(len(place) != 3 for place in found):
        raise argparse.ArgumentTypeError(f"not two or more places, such as 0,0,0:1,0,0: {words!r}")
    return found


def plane(words):
    """Return the plane that is named, for argparse."""
    try:
        return plane_of(words)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def command_line():
    """Return the command line's options."""
    parser = argparse.ArgumentParser(prog="show", description=__doc__.partition("\n")[0])
    parser.add_argument("result", help="a result file, NAME.vtkhdf")
    parser.add_argument(
        "-o", metavar="FOLDER", dest="folder", type=Path,
        help="where the pictures go (NAME-pictures in the working directory), or the page",
    )
    parser.add_argument(
        "--scale", type=float, help="factor of the drawn displacements (chosen to be visible)"
    )
    parser.add_argument(
        "--only", metavar="NAME,...", type=names_of_pictures,
        help=f"these pictures alone: {', '.join(NAMES)}",
    )
    parser.add_argument(
        "--component", choices=[name for names in COMPONENTS.values() for name in names],
        help="of the displacement or the stress, in place of its magnitude",
    )
    parser.add_argument(
        "--along", type=places, metavar="X,Y,Z:X,Y,Z",
        help="values along the straight lines between places of the undeformed bodies, as a curve"
        " and a table, instead of the pictures (--along=-1,0,0:1,0,0 where a minus comes first)",
    )
    parser.add_argument(
        "--increment", type=int, default=-1, metavar="N",
        help="the stored increment that is drawn, from 0; negative: from the last (-1)",
    )
    parser.add_argument(
        "--view", type=float, nargs=2, metavar=("ELEVATION", "AZIMUTH"),
        help="from where bodies are seen, in degrees (chosen)",
    )
    parser.add_argument(
        "--clip", type=plane, metavar="x=PLACE",
        help="cut away what lies before a plane across x, y or z, in the middle or at a place",
    )
    parser.add_argument(
        "--turn", type=float, nargs="?", const=270.0, metavar="DEGREES",
        help="turn the section of bodies of revolution about its axis, by 270 degrees or others",
    )
    parser.add_argument(
        "--range", type=float, nargs=2, metavar=("LOW", "HIGH"), dest="limits",
        help="of the colours of the bodies (those of the increment)",
    )
    parser.add_argument(
        "--dpi", type=int, help="dots per inch of the pictures (chosen: they are 1200 pixels wide)"
    )
    parser.add_argument(
        "--format", choices=("png", "svg", "pdf"), default="png", help="of the pictures"
    )
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--html", action="store_true", help="one page with everything, NAME.html")
    form.add_argument(
        "--frd", action="store_true",
        help="mesh and results for cgx, FreeCAD and PrePoMax, NAME.frd, instead of the pictures",
    )
    form.add_argument("--interactive", action="store_true", help="a window (needs pyvista)")
    parser.add_argument("--no-animation", action="store_true", help="pictures only")
    parser.add_argument("--mp4", action="store_true", help="an MP4 film, not a GIF (needs ffmpeg)")
    options = parser.parse_args()
    if options.limits and not options.limits[0] < options.limits[1]:
        parser.error("--range: LOW must be less than HIGH")
    if options.dpi is not None and not 10 <= options.dpi <= 2400:
        parser.error("--dpi: 10 to 2400")
    return options


def draw_all(result, look, folder, options):
    """Draw what the file holds; yield the path of each picture as it is made."""
    folder.mkdir(parents=True, exist_ok=True)
    for picture in pictures_of(result, look, options.only):
        path = folder / f"{picture.name}.{options.format}"
        save(picture.figure, path, picture.tight, dpi=options.dpi)
        yield path
    if has_bodies(result) and not (options.no_animation or options.only):
        path = folder / ("animation.mp4" if options.mp4 else "animation.gif")
        writer = animation.FFMpegWriter if options.mp4 else animation.PillowWriter
        animate(result, path, writer, look)
        yield path


def draw_along(result, look, folder, options):
    """Draw what lies along a path, and write it as a table; yield both paths."""
    try:
        path = result.along(options.along, POINTS)
    except ValueError as error:
        raise ResultError(f"--along: {error}") from error
    folder.mkdir(parents=True, exist_ok=True)
    picture, table = folder / f"along.{options.format}", folder / "along.csv"
    save(path.plot(look.index), picture, dpi=options.dpi)
    yield picture
    path.to_csv(table, look.index)
    yield table


def show(result, options):
    """Show the result as the options ask for it."""
    if result.run.get("status") not in ("finished", "settled"):
        note = f"the run's status is '{result.run.get('status')}'"
        print(f"show: {note}: {result.finished} increments to show", file=sys.stderr)
    stored = len(result.field_rows)
    if has_bodies(result) and not -stored <= options.increment < stored:
        raise ResultError(f"--increment {options.increment}: {stored} are stored, from 0")
    look = Look(
        options.scale, options.increment, options.view, options.limits, options.component,
        options.clip, options.dpi, options.turn,
    )
    if options.interactive:
        open_window(result, options.scale)
        return
    if options.frd:
        folder = options.folder or Path()
        folder.mkdir(parents=True, exist_ok=True)
        print(result.to_frd(folder / f"{result.path.stem}.frd"))
        return
    if not has_bodies(result):
        print("show: the file holds no displacements: no picture of the body", file=sys.stderr)
    if options.html:
        folder = options.folder or Path()
        folder.mkdir(parents=True, exist_ok=True)
        print(write_page(result, folder / f"{result.path.stem}.html", look))
        return
    folder = options.folder or Path(f"{result.path.stem}-pictures")
    drawn = 0
    draw = draw_along if options.along else draw_all
    for path in draw(result, look, folder, options):
        print(path)
        drawn += 1
    if not drawn:
        raise ResultError(f"the file has no {' or '.join(options.only)}")


def main():
    """Draw the result named on the command line."""
    options = command_line()
    if options.mp4 and not animation.FFMpegWriter.isAvailable():
        sys.exit("show: --mp4 needs ffmpeg (apt-get install ffmpeg)")
    try:
        with Result(options.result) as result:
            if result.finished == 0:
                raise ResultError(f"{options.result}: no increment is finished")
            show(result, options)
    except (ResultError, OSError) as error:
        sys.exit(f"show: {error}")


if __name__ == "__main__":
    main()
