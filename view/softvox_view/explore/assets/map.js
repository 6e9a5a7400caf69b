// The map: every design a cell, with marks, searchers' paths, and a cursor for mouse and keys.

import { evaluationColour } from "./colours.js";
import { digitsOf, paintRobot } from "./robot.js";
import { MARKERS, Sheet } from "./sheet.js";
import { gestures, MapWindow } from "./zoom.js";

const JUMP = 9; // cells, with Shift: the side of a square two levels deep
const KEY_ZOOMS = { "+": 1.5, "=": 1.5, "-": 1 / 1.5, 0: 0 };
const ROBOT_CELL = 34; // px: robots are drawn in cells that are as wide,
const MOST_ROBOTS = 14; // and this many across at most
const ARROW_ROOM = 24; // px that an arrow needs
const TOP_COLOUR = "#f0003c";
const PICTURE = 648; // px: of the map to download
// The nested squares: cells along a side, how thick their lines are, and how opaque.
const LEVELS = [[1, 0.6, 0.3], [3, 1, 0.3], [9, 1.5, 0.35], [27, 2.5, 0.6]];

/**
 * Make a map of a canvas; it calls onPick(design) and onPoint(design).
 * Returns {paint, show, zoom, picture}.
 *
 * paint({colour, grid, arrows, top}) colours the cells: colour(design) is [r, g, b], or null to
 * cross it out; arrows {dx, dy}, to be drawn, and top, designs to outline, may be absent.
 * show(what) shows over the colours: marks {letter: design}; best {from, to}, where the best went,
 * or null; paths [{designs, best, colour}] and upto, of how many evaluations. zoom(factor) zooms in,
 * for 0 to the whole map; picture() is a canvas with what is seen now.
 */
export function landscapeMap(canvas, { side, cells }, onPick, onPoint) {
  const pixels = new OffscreenCanvas(side, side);
  const seen = new MapWindow(side);
  const placeOf = []; // [column, row from the bottom] of a design
  cells.forEach((design, k) => (placeOf[design] = [k % side, Math.floor(k / side)]));
  const inside = (k) => Math.min(Math.max(k, 0), side - 1);
  const designAt = ([column, row]) => cells[row * side + column];
  const middleOf = (design) => placeOf[design].map((k) => k + 0.5);
  let [sheet, ratio, width] = [null, 1, canvas.width]; // width in CSS pixels
  let painted = { diverged: [], grid: "#fff", arrows: () => [], edges: [] };
  let cursor = null; // [column, row]
  let shown = { marks: {}, best: null, paths: [], upto: 0 };

  const centre = (design) => sheet.at(middleOf(design));

  function point(place) {
    if (String(place) === String(cursor)) return;
    cursor = place;
    draw();
    if (place) onPoint(designAt(place));
  }

  function zoom(factor, isAtCursor = false) {
    const share = (k, low) => (k + 0.5 - low) / seen.span;
    const isSeen = isAtCursor && cursor && sheet.has(cursor);
    seen.zoom(factor, isSeen ? [share(cursor[0], seen.left), share(cursor[1], seen.bottom)] : undefined);
    if (isSeen) seen.include(cursor);
    moved();
  }

  /** Draw after the window moved. One finger scrolls the page while the map has nowhere to go. */
  function moved() {
    canvas.style.touchAction = seen.isWhole ? "pan-y" : "none";
    draw();
  }

  function key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = event.shiftKey ? JUMP : 1;
    const move = {
      ArrowLeft: [-step, 0],
      ArrowRight: [step, 0],
      ArrowUp: [0, step],
      ArrowDown: [0, -step],
    }[event.key];
    const place = cursor ?? placeOf[shown.marks.A ?? 0];
    if (move) {
      const next = place.map((k, axis) => inside(k + move[axis]));
      seen.include(next);
      point(next);
    } else if (event.key in KEY_ZOOMS) zoom(KEY_ZOOMS[event.key], true);
    else if (event.key === "Enter" || event.key === " ") onPick(designAt(place));
    else return;
    event.preventDefault();
  }

  function drawCells() {
    const { pen, cell } = sheet;
    const { left, bottom, span } = seen;
    pen.imageSmoothingEnabled = false;
    pen.drawImage(pixels, left, side - bottom - span, span, span, 0, 0, sheet.width, sheet.width);
    const reach = 0.3 * cell;
    sheet.lines("#000", Math.max(1, cell / 20), () => {
      for (const [x, y] of painted.diverged.map(centre)) {
        for (const slope of [1, -1]) {
          pen.moveTo(x - reach, y - slope * reach);
          pen.lineTo(x + reach, y + slope * reach);
        }
      }
    });
    for (const [every, thick, alpha] of LEVELS.filter(([every]) => every * cell > 20)) {
      pen.globalAlpha = alpha;
      sheet.lines(painted.grid, thick, () => {
        for (let k = every; k < side; k += every) {
          const [x, y] = sheet.at([k, k]).map(Math.round);
          pen.moveTo(x, 0);
          pen.lineTo(x, sheet.width);
          pen.moveTo(0, y);
          pen.lineTo(sheet.width, y);
        }
      });
    }
    pen.globalAlpha = 1;
  }

  /** Draw arrows for squares of so many cells that there is room for one in each. */
  function drawArrows() {
    const block = [1, 3, 9, 27].find((block) => block * sheet.cell >= ARROW_ROOM);
    // Beside a robot, not on it.
    const [off, part] = hasRobots() ? [0.32, 0.34] : [0, 0.9];
    const own = painted.arrows(block).filter(({ place }) => sheet.has(place.map((k) => k - 0.5)));
    sheet.outlined(() => {
      for (const { place, angle, share } of own) {
        const long = Math.max(part * share * block * sheet.cell, 5);
        sheet.arrow(sheet.at(place.map((k) => k - off)), angle, long);
      }
    }, "#fff", 1.5);
  }

  function hasRobots() {
    return sheet.cell >= ROBOT_CELL && seen.span <= MOST_ROBOTS;
  }

  /** Draw robots where there is room; returns how many. */
  function drawRobots() {
    if (!hasRobots()) return 0;
    const own = cells.filter((design) => sheet.has(placeOf[design]));
    for (const design of own) {
      const [x, y] = centre(design);
      paintRobot(sheet.pen, digitsOf(design), [x, y], 0.24 * sheet.cell);
      if (sheet.cell > 1.6 * ROBOT_CELL) sheet.write(design, x, y + 0.4 * sheet.cell, 11);
    }
    return own.length;
  }

  function drawPath({ designs, best, colour }, k) {
    const reach = Math.min(Math.max(sheet.cell / 2, 2.6), 6);
    const off = hasRobots() ? 0.36 : 0; // cells: robots are not to be hidden
    const at = (design) => sheet.at(middleOf(design).map((place) => place - off));
    const most = Math.max(...shown.paths.map((path) => path.designs.length));
    designs.slice(0, shown.upto).forEach((design, i) => {
      sheet.polygon(MARKERS[k], at(design), reach, evaluationColour(i / most));
    });
    const line = best.filter((one) => one.at < shown.upto).map(({ design }) => at(design));
    if (!line.length) return;
    sheet.chain(line, colour);
    sheet.write("S", ...at(designs[0]), 13);
    sheet.write("◆", ...line.at(-1), 20);
  }

  function drawBest({ from, to }) {
    if (from !== to) {
      sheet.chain([centre(from), centre(to)]);
      sheet.write("☆", ...centre(from), 22);
    }
    sheet.write("★", ...centre(to), 24);
  }

  function drawMark([letter, design]) {
    if (!design || !sheet.has(placeOf[design])) return;
    // Whole also where the cell is at the edge.
    const reach = Math.max(8, sheet.cell / 2 - 2);
    const on = (k, margin) => Math.min(Math.max(k, margin), sheet.width - margin);
    const [x, y] = centre(design).map((k) => on(k, reach + 3));
    const isSmall = sheet.cell < ROBOT_CELL;
    sheet.outlined((pen) => {
      if (isSmall) pen.arc(x, y, reach, 0, 2 * Math.PI);
      else pen.rect(x - reach, y - reach, 2 * reach, 2 * reach);
    });
    const aside = isSmall ? reach + 12 : reach - 10;
    const top = isSmall ? y : y - reach + 11;
    sheet.write(letter, x < sheet.width - aside - 14 ? x + aside : x - aside, on(top, 10), 18);
  }

  function layers() {
    drawCells();
    sheet.lines(TOP_COLOUR, Math.min(Math.max(1.8, sheet.cell / 12), 3), (pen) => {
      for (const [from, to] of painted.edges) {
        pen.moveTo(...sheet.at(from));
        pen.lineTo(...sheet.at(to));
      }
    });
    const robots = drawRobots();
    drawArrows();
    shown.paths.forEach(drawPath);
    if (shown.best) drawBest(shown.best);
    Object.entries(shown.marks).forEach(drawMark);
    return robots;
  }

  function draw() {
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    sheet = new Sheet(pen, width, seen);
    const { left, bottom, span } = seen;
    const robots = layers();
    Object.assign(canvas.dataset, { robots, window: [left, bottom, span].map((k) => k.toFixed(2)).join(" ") });
    if (!cursor) return;
    const [x, y] = sheet.at([cursor[0], cursor[1] + 1]);
    sheet.outlined(() => pen.rect(x - 1, y - 1, sheet.cell + 2, sheet.cell + 2));
  }

  canvas.addEventListener("keydown", key);
  gestures(canvas, seen, {
    onMove: moved,
    onPoint: (place) => point(place && seen.cellAt(place)),
    onPick(place) {
      point(seen.cellAt(place));
      onPick(designAt(cursor));
    },
  });
  new ResizeObserver(() => {
    if (!canvas.clientWidth) return;
    [ratio, width] = [devicePixelRatio, canvas.clientWidth];
    canvas.width = canvas.height = Math.round(ratio * width);
    draw();
  }).observe(canvas);
  moved();

  return {
    paint({ colour, grid, arrows, top = [] }) {
      const image = new ImageData(side, side);
      const diverged = [];
      cells.forEach((design) => {
        const [column, row] = placeOf[design];
        const made = colour(design);
        if (!made) diverged.push(design);
        const rgb = (made ?? [255, 255, 255]).map(Math.round);
        image.data.set([...rgb, 255], 4 * ((side - 1 - row) * side + column));
      });
      pixels.getContext("2d").putImageData(image, 0, 0);
      const made = {}; // by the squares' side, once they are asked for
      const arrowsFor = (block) => (made[block] ??= arrows ? arrowsOf(arrows, cells, side, block) : []);
      painted = { diverged, grid, arrows: arrowsFor, edges: edgesOf(top.map((design) => placeOf[design])) };
      canvas.dataset.outlined = top.length;
      draw();
    },
    show(what) {
      shown = { ...shown, ...what };
      draw();
    },
    zoom,
    picture() {
      const made = new OffscreenCanvas(PICTURE, PICTURE);
      sheet = new Sheet(made.getContext("2d"), PICTURE, seen);
      layers();
      return made;
    },
  };
}

/** Where arrows stand and point, one for the mean displacement of each square of so many cells. */
function arrowsOf({ dx, dy }, cells, side, block) {
  const across = side / block;
  const sums = Array.from({ length: across * across }, () => [0, 0]);
  cells.forEach((design, k) => {
    const sum = sums[Math.floor(k / side / block) * across + Math.floor((k % side) / block)];
    sum[0] += dx[design] ?? 0;
    sum[1] += dy[design] ?? 0;
  });
  const most = Math.max(1e-9, ...sums.map((sum) => Math.hypot(...sum)));
  const made = sums.map(([x, y], k) => ({
    place: [k % across, Math.floor(k / across)].map((at) => (at + 0.5) * block),
    angle: Math.atan2(-y, x),
    share: Math.sqrt(Math.hypot(x, y) / most), // a root, to see where to also what travels less goes
  }));
  return made.filter(({ share }) => share > 0.2);
}

/** The lines around cells [column, row], as [from, to]. */
function edgesOf(places) {
  const all = new Set(places.map(String));
  return places.flatMap(([column, row]) => {
    const sides = [[-1, 0], [1, 0], [0, -1], [0, 1]].filter(([x, y]) => !all.has(`${column + x},${row + y}`));
    return sides.map(([x, y]) => {
      const [a, b] = [column + 0.5 + x / 2, row + 0.5 + y / 2]; // the middle of the side
      return [[a - y / 2, b - x / 2], [a + y / 2, b + x / 2]];
    });
  });
}
