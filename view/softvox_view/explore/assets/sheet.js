// A pen that draws over the cells of the map.

/** Shapes that distinguish searchers, as corners about [0, 0]. */
export const MARKERS = [
  [[-1, -1], [1, -1], [1, 1], [-1, 1]],
  [[0, -1.35], [1.25, 0.95], [-1.25, 0.95]],
  [[0, -1.4], [1.4, 0], [0, 1.4], [-1.4, 0]],
  [[-0.5, -1.2], [0.5, -1.2], [1.2, 0], [0.5, 1.2], [-0.5, 1.2], [-1.2, 0]],
];

/** A pin, which points at [0, 0]. */
export const PIN = [[0, 0], [-1.1, -1.4], [-1.1, -2.5], [1.1, -2.5], [1.1, -1.4]];

/** Draws the content of a window into a square; lengths are CSS pixels, places are cells. */
export class Sheet {
  constructor(pen, width, seen) {
    Object.assign(this, { pen, width, seen, cell: width / seen.span });
  }

  /** The position in the square of a place on the map, in cells from the lower left. */
  at([column, row]) {
    return [(column - this.seen.left) * this.cell, this.width - (row - this.seen.bottom) * this.cell];
  }

  /** Whether a place is visible, or less than a margin of cells away. */
  has(place, margin = 0) {
    return this.at(place).every((k) => Math.abs(k - this.width / 2) < this.width / 2 + margin * this.cell);
  }

  lines(colour, thick, trace) {
    this.pen.lineJoin = "round";
    this.pen.strokeStyle = colour;
    this.pen.lineWidth = thick;
    this.pen.beginPath();
    trace(this.pen);
    this.pen.stroke();
  }

  /** Draw lines with a dark rim, visible on any colour. */
  outlined(trace, colour = "#fff", thick = 2) {
    this.lines("#000", 1.5 * thick + 2, trace);
    this.lines(colour, thick, trace);
  }

  /** Connect points, with an arrowhead if there is room for it. */
  chain(points, colour) {
    this.outlined((pen) => {
      points.forEach((point) => pen.lineTo(...point));
      points.slice(1).forEach(([x, y], i) => {
        const [across, down] = [x - points[i][0], y - points[i][1]];
        if (Math.hypot(across, down) > 16) this.#head(x - across / 3, y - down / 3, Math.atan2(down, across), 7);
      });
    }, colour);
  }

  /** Trace an arrow about a point, with its angle clockwise from the right. */
  arrow([x, y], angle, long) {
    const [across, down] = [Math.cos(angle), Math.sin(angle)].map((part) => (part * long) / 2);
    this.pen.moveTo(x - across, y - down);
    this.pen.lineTo(x + across, y + down);
    this.#head(x + across, y + down, angle, Math.max(3, long / 3));
  }

  #head(x, y, angle, long) {
    for (const turned of [angle + 2.6, angle - 2.6]) {
      this.pen.moveTo(x + Math.cos(turned) * long, y + Math.sin(turned) * long);
      this.pen.lineTo(x, y);
    }
  }

  polygon(corners, [x, y], reach, fill) {
    this.lines("#000", 2, (pen) => {
      for (const [u, v] of corners) pen.lineTo(x + reach * u, y + reach * v);
      pen.closePath();
    });
    this.pen.fillStyle = fill;
    this.pen.fill();
  }

  /** Write a text about a point, moved inward at the edge so that all of it is visible. */
  write(text, left, top, size) {
    const whole = (k) => (k < 0 || k > this.width ? k : Math.min(Math.max(k, size / 2), this.width - size / 2));
    const [x, y] = [left, top].map(whole);
    this.pen.font = `bold ${size}px system-ui, sans-serif`;
    this.pen.textAlign = "center";
    this.pen.textBaseline = "middle";
    this.pen.lineWidth = 4;
    this.pen.strokeStyle = "#000";
    this.pen.strokeText(text, x, y);
    this.pen.fillStyle = "#fff";
    this.pen.fillText(text, x, y);
  }
}
