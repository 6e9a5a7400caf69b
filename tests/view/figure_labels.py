"""Whether the labels of a figure can be read."""

from matplotlib.axes import Axes
from matplotlib.text import Text


def ticks_shown(axes):
    """The tick labels that a reader sees: matplotlib also keeps those beyond the ends."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        slack = 1e-9 * (high - low)
        for tick in axis.get_major_ticks():
            if low - slack <= tick.get_loc() <= high + slack:
                yield from (tick.label1, tick.label2)


def texts_of(figure):
    every = {id(text): text for text in figure.findobj(Text)}
    for axes in figure.findobj(Axes):
        for axis in (axes.xaxis, axes.yaxis):
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                every.pop(id(tick.label1), None)
                every.pop(id(tick.label2), None)
        if axes.axison:
            every |= {id(text): text for text in ticks_shown(axes)}
        else:
            for text in (axes.xaxis.label, axes.yaxis.label):
                every.pop(id(text), None)
    return [text for text in every.values() if text.get_visible() and text.get_text().strip()]


def check_labels(figure):
    """No text lies on another, or off the page; to be called in the figure's style."""
    figure.draw_without_rendering()
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts_of(figure)]
    page = figure.bbox
    for text, box in boxes:
        assert page.x0 - 1 <= box.x0 <= box.x1 <= page.x1 + 1, text
        assert page.y0 - 1 <= box.y0 <= box.y1 <= page.y1 + 1, text
    for i, (text, box) in enumerate(boxes):
        for other, second in boxes[i + 1 :]:
            across = min(box.x1, second.x1) - max(box.x0, second.x0)
            up = min(box.y1, second.y1) - max(box.y0, second.y0)
            assert min(across, up) <= 1, f"{text!r} lies on {other!r}"
