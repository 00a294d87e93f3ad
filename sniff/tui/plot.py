"""A plot of a value over time: by textual-plot (the extra `plot`) where it is installed, else a row of bars."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.util import find_spec

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widget import Widget
from textual.widgets import Sparkline, Static

from dissectors.line import NS_PER_S
from sniff.analysis.sanitizing import sanitized

HAS_PLOT = find_spec("textual_plot") is not None
if HAS_PLOT:
    from textual_plot import HiResMode, PlotWidget

UNITS = ((3600 * NS_PER_S, "hours"), (60 * NS_PER_S, "minutes"), (NS_PER_S, "seconds"))
LONG = 5
"""So many of a unit are counted in it."""

LEAST = 3
"""Values that make a plot."""


FRAME = 5
"""Lines of a plot that are not the plot: its title, the box, and the times."""


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between two, evenly apart, `most` of them at most and two at least where there are so many."""
    span = high - low
    power = 10.0 ** math.floor(math.log10(span)) if span > 0 else 1.0
    found = [low]
    for step in (power * one for one in (5, 2, 1, 0.5, 0.2, 0.1)):
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        if last - first + 1 > max(2, most) and len(found) > 1:
            break
        found = [round(at * step, 12) for at in range(first, last + 1)] or found
    return found


class HistoryPlot(Vertical):
    """Times, ns, and values. The newest is at the right, the axis counts seconds before it, or minutes, or hours."""

    DEFAULT_CSS = """
    HistoryPlot { height: 11; width: 100%; }
    HistoryPlot > PlotWidget, HistoryPlot > Sparkline { height: 1fr; }
    HistoryPlot > Static { height: 1; padding: 0 1; color: $text-muted; }
    HistoryPlot > PlotWidget > .plot--tick { color: $foreground; text-style: none; }
    """

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self._drawn: tuple[str, tuple[tuple[int, float], ...]] = ("", ())
        self._limits: tuple[float, float, bool] | None = None  # of the axis; whether all values are the same

    def compose(self) -> ComposeResult:
        """A title, and the plot."""
        yield Static(id="plot-title", markup=False)
        yield self._canvas()

    def _canvas(self) -> Widget:
        if not HAS_PLOT:
            return Sparkline([], id="plot-canvas")
        made: Widget = PlotWidget(id="plot-canvas", allow_pan_and_zoom=False)
        made.can_focus = False  # the arrows are the table's
        return made

    def on_resize(self) -> None:
        """More lines, more numbers at the axis."""
        self._put_ticks()

    def _put_ticks(self) -> None:
        canvas = self.query_one("#plot-canvas")
        if self._limits is None or isinstance(canvas, Sparkline):
            return
        assert isinstance(canvas, PlotWidget)
        low, high, is_steady = self._limits
        canvas.set_yticks([(low + high) / 2] if is_steady else ticks(low, high, (self.size.height - FRAME) // 2))
        canvas.refresh(layout=True)  # which is when it draws anew

    def show(self, title: str, history: Sequence[tuple[int, float]], least: float | None = None) -> None:
        """Draw these values, unless they are drawn already. `least`: where the axis begins, where that is not theirs to
        say."""
        span = history[-1][0] - history[0][0] if history else 0
        unit, name = next((one for one in UNITS if span >= LONG * one[0]), UNITS[-1])
        title = f"{title}; {name} before the newest" if title else ""
        state = title, tuple(history)
        if state == self._drawn:
            return
        self._drawn = state
        few = len(history) < LEAST
        self.query_one("#plot-title", Static).update(sanitized(f"{title}: too few values for a plot" if few else title))
        canvas = self.query_one("#plot-canvas")
        if isinstance(canvas, Sparkline):
            canvas.data = [] if few else [value for _, value in history]
            return
        assert isinstance(canvas, PlotWidget)
        canvas.margin_top, canvas.margin_bottom = 1, 2  # no titles on the axes
        canvas.clear()
        canvas.visible = not few  # axes of nothing would say something
        if few:
            return
        newest = history[-1][0]
        before = [(time - newest) / unit for time, _ in history]
        values = [value for _, value in history]
        low, high = min(values), max(values)
        spare = (high - low) * 0.05 or max(1.0, abs(high) * 0.05)
        canvas.set_xlimits(min(before[0], -1e-3), 0.0)
        bottom, top = low - spare if least is None else least, high + spare
        canvas.set_ylimits(bottom, top)
        self._limits = bottom, top, low == high
        self._put_ticks()
        canvas.plot(before, values, line_style="cyan", hires_mode=HiResMode.BRAILLE)
