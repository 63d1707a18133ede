"""Nav2's smoothers again, slowly: point by point, in Python's own numbers, and recursive where Nav2 is."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.costmap import Costmap

SHORTEST = {"humble": 9, "jazzy": 9, "lyrical": 3}


def shortest_turn(first: float, second: float) -> float:
    turn = math.fmod(second - first + math.pi, 2.0 * math.pi)
    return turn + math.pi if turn <= 0.0 else turn - math.pi


def segments(path: list[list[float]], cut: bool) -> list[tuple[int, int]]:
    found, begin = [], 0
    for i in range(1, len(path) - 1) if cut else ():
        (ax, ay, _), (bx, by, yaw), (cx, cy, next_yaw) = path[i - 1 : i + 2]
        back = (bx - ax) * (cx - bx) + (by - ay) * (cy - by) < 0.0
        stands = abs(cx - bx) < 1e-4 and abs(cy - by) < 1e-4
        if back or (stands and abs(shortest_turn(yaw, next_yaw)) > 1e-4):
            found.append((begin, i))
            begin = i
    return [*found, (begin, len(path) - 1)]


def turned(path: list[list[float]]) -> list[list[float]]:
    direction = math.atan2(path[2][1] - path[1][1], path[2][0] - path[1][0])
    backwards = abs(shortest_turn(path[1][2], direction)) > math.pi / 2.0
    result = [list(pose) for pose in path]
    for i in range(len(path) - 1):
        dx, dy = path[i + 1][0] - path[i][0], path[i + 1][1] - path[i][1]
        if abs(dx) < 1e-4 and abs(dy) < 1e-4:
            continue
        yaw = math.atan2(dy, dx) + (math.pi if backwards else 0.0)
        result[i][2] = yaw - 2.0 * math.pi if yaw > math.pi else yaw
    return result


class PlainSimple:
    """The simple smoother of a release; its refinements are calls of itself."""

    def __init__(self, params, release: str) -> None:
        self.params, self.release = params, release
        self.count = 0
        self.most = 4 if release == "humble" else params.refinement_num

    def smooth(self, costmap: Costmap, path: np.ndarray) -> tuple[np.ndarray, bool]:
        result, success, self.count = path.tolist(), True, 0
        for begin, end in segments(path.tolist(), self.params.enforce_path_inversion is not False):
            if end - begin <= SHORTEST[self.release]:
                continue
            if self.release == "humble" and not success:
                continue
            if self.release != "humble":
                self.count = 0
            part, rests = self.pulled(costmap, result[begin : end + 1])
            result[begin : end + 1] = turned(part)
            success = success and rests
        return np.array(result), success or self.release != "humble"

    def pulled(self, costmap: Costmap, path: list[list[float]]) -> tuple[list[list[float]], bool]:
        new, last = [list(pose) for pose in path], [list(pose) for pose in path]
        change, rounds = self.params.tolerance, 0
        while change >= self.params.tolerance:
            rounds, change = rounds + 1, 0.0
            if rounds >= self.params.max_its:
                return last, False
            for i in range(1, len(path) - 1):
                for axis in range(2):
                    old = new[i][axis]
                    pull = self.params.w_data * (path[i][axis] - old)
                    new[i][axis] = old + pull + self.params.w_smooth * (new[i + 1][axis] + new[i - 1][axis] - 2.0 * old)
                    change += abs(new[i][axis] - old)
                cell = costmap.world_to_map(new[i][0], new[i][1])
                if cell is None or 252 < costmap.costs[cell] < 255:
                    return last, False
            last = [list(pose) for pose in new]
        if self.params.do_refinement and self.count < self.most:
            self.count += 1
            new, _ = self.pulled(costmap, new)
        return new, True


class PlainSavitzkyGolay:
    """The Savitzky-Golay smoother of a release, with windows that are written out."""

    def __init__(self, params, release: str) -> None:
        self.params, self.release = params, release

    def smooth(self, costmap: Costmap, path: np.ndarray) -> tuple[np.ndarray, bool]:
        size = self.params.window_size or 7
        result = path.tolist()
        for begin, end in segments(path.tolist(), self.params.enforce_path_inversion is not False):
            if end - begin <= size + 2:
                continue
            part = result[begin : end + 1]
            for _ in range(1 + (self.params.refinement_num if self.params.do_refinement else 0)):
                part = self.filtered(part, size)
            result[begin : end + 1] = turned(part)
        return np.array(result), True

    def filtered(self, path: list[list[float]], size: int) -> list[list[float]]:
        new = [list(pose) for pose in path]
        source, half = new if self.release == "humble" else path, size // 2
        for i in range(1, len(path) - 1):
            if self.release == "humble" and i == len(path) - 4:
                continue
            window = [source[min(max(i + j, 0), len(path) - 1)][:2] for j in range(-half, half + 1)]
            new[i][:2] = self.fitted(window)
        return new

    def fitted(self, window: list[list[float]]) -> list[float]:
        """The value in the middle of the polynomials that fit the window best."""
        half = len(window) // 2
        order = 3 if self.params.poly_order is None else self.params.poly_order
        along = np.arange(-half, half + 1)
        return [float(np.polyfit(along, [point[axis] for point in window], order)[-1]) for axis in range(2)]
