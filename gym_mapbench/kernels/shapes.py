"""Random shapes scattered over a grid. The generator is NumPy's; compiled code draws the same numbers from it."""

from __future__ import annotations

from gym_mapbench.kernels.jit import kernel


@kernel
def scatter(rng, cells, count, shares, sizes):
    """Occupy the cells under ``count`` random shapes, each at a random place inside ``(rows, cols)`` bool cells.

    Args:
        rng: Generator that everything is drawn from.
        cells: ``(rows, cols)`` bool, in and out.
        count: Number of shapes.
        shares: As for :func:`draw_shape`.
        sizes: As for :func:`draw_shape`.
    """
    rows, cols = cells.shape
    for _ in range(count):
        height, width, is_round = draw_shape(rng, shares, sizes)
        row, col = draw_position(rng, height, width, rows, cols)
        occupy(cells, row, col, height, width, is_round)


@kernel
def draw_shape(rng, shares, sizes):
    """Draw kind, size and orientation of a shape: its height and width (cells), and whether it is a disc.

    Args:
        rng: Generator.
        shares: Probability of a disc, and of a square; the rest are walls.
        sizes: Smallest and largest radius of a disc, side of a square, length and thickness of a wall, cells.
    """
    radius, side, length, thickness = sizes
    kind = rng.random()
    if kind < shares[0]:
        drawn = 2 * draw_size(rng, radius) + 1
        return drawn, drawn, True
    if kind < shares[0] + shares[1]:
        drawn = draw_size(rng, side)
        return drawn, drawn, False
    thick, long = draw_size(rng, thickness), draw_size(rng, length)
    if rng.integers(0, 2):
        return thick, long, False
    return long, thick, False


@kernel
def draw_size(rng, bounds):
    """Draw an integer; both bounds belong to the range."""
    return rng.integers(bounds[0], bounds[1] + 1)


@kernel
def draw_position(rng, height, width, rows, cols):
    """Draw ``(row, col)`` of a shape's lower-left cell, uniformly; one larger than the area is placed at 0."""
    row = rng.integers(0, max(1, rows - height + 1))
    col = rng.integers(0, max(1, cols - width + 1))
    return row, col


@kernel
def occupy(cells, row, col, height, width, is_round):
    """Occupy the cells of a box whose lower-left cell is ``(row, col)``, or of the disc in it; the rest is cut off."""
    rows, cols = cells.shape
    radius = height // 2
    for r in range(max(0, row), min(rows, row + height)):
        for c in range(max(0, col), min(cols, col + width)):
            up, right = r - row - radius, c - col - radius
            if not is_round or up * up + right * right <= radius * radius:
                cells[r, c] = True
