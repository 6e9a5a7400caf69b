// The map: every design is a cell; with marks, searchers' paths, and a cursor for mouse and keys.

import { evaluationColour } from "./colours.js";
import { digitsOf, paintRobot } from "./robot.js";
import { MARKERS, PIN, Sheet } from "./sheet.js";
import { gestures, MapWindow } from "./zoom.js";

const JUMP = 9; // cells, with Shift: the side of a square two levels deep
const KEY_ZOOMS = { "+": 1.5, "=": 1.5, "-": 1 / 1.5, 0: 0 };
const ROBOT_CELL = 34; // px: robots are drawn in cells at least this wide,
const MOST_ROBOTS = 14; // with at most this many across
const ARROW_ROOM = 24; // px that an arrow needs
const TOP_COLOUR = "#f0003c";
const PICTURE = 648; // px
// The nested squares: cells along a side, how thick their lines are, and how opaque.
const LEVELS = [[1, 0.6, 0.3], [3, 1, 0.3], [9, 1.5, 0.35], [27, 2.5, 0.6]];

/**
 * Make a map on a canvas that shows what a MapWindow selects; it calls onPick(design) and
 * onPoint(design). Returns {paint, show, picture}; picture() is a canvas with the visible part,
 * however small the map.
 *
 * paint({colour, grid, arrows, top}) colours the cells: colour(design) is [r, g, b], or null to
 * cross it out; arrows {dx, dy} to draw, and top, designs to outline, are optional.
 * show(what) draws over the colours: marks {letter: design}; best {from, to}, the old and the new best,
 * or null; paths [{designs, best, colour}] and upto, their number of evaluations; tried {designs,
 * colour}.
 */
export function landscapeMap(canvas, { side, cells }, onPick, onPoint, seen) {
  const pixels = new OffscreenCanvas(side, side);
  const placeOf = []; // [column, row from the bottom] of a design
  cells.forEach((design, k) => (placeOf[design] = [k % side, Math.floor(k / side)]));
  const inside = (k) => Math.min(Math.max(k, 0), side - 1);
  const designAt = ([column, row]) => cells[row * side + column];
  const middleOf = (design) => placeOf[design].map((k) => k + 0.5);
  let [sheet, ratio, width] = [null, 1, canvas.width]; // width in CSS pixels
  let painted = { diverged: [], grid: "#fff", arrows: () => [], top: [] };
  let cursor = null; // [column, row]
  let shown = { marks: {}, best: null, paths: [], upto: 0, tried: { designs: [] } };

  const centre = (design) => sheet.at(middleOf(design));
  const hasRobots = () => sheet.cell >= ROBOT_CELL && seen.span <= MOST_ROBOTS;

  function point(place) {
    if (String(place) === String(cursor)) return;
    cursor = place;
    draw();
    if (place) onPoint(designAt(place));
  }

  /** Zoom about the cursor, or about the middle. */
  function zoomByKey(factor) {
    if (!cursor) return seen.zoom(factor);
    const [x, y] = sheet.at(cursor.map((k) => k + 0.5));
    seen.zoom(factor, [x / sheet.width, 1 - y / sheet.width]);
    seen.include(cursor);
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
    } else if (event.key in KEY_ZOOMS) zoomByKey(KEY_ZOOMS[event.key]);
    else if (event.key === "Enter" || event.key === " ") onPick(designAt(place));
    else return;
    event.preventDefault();
  }

  function drawCells() {
    const { pen, cell } = sheet;
    const { left, bottom, span } = seen;
    pen.imageSmoothingEnabled = false;
    pen.drawImage(pixels, left, side - bottom - span, span, span, 0, 0, sheet.width, sheet.width);
    sheet.lines("#000", Math.max(1, cell / 20), () => {
      for (const [x, y] of painted.diverged.map(centre)) {
        for (const slope of [0.3 * cell, -0.3 * cell]) {
          pen.moveTo(x - 0.3 * cell, y - slope);
          pen.lineTo(x + 0.3 * cell, y + slope);
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

  /** Draw arrows, each for a square of so many cells that it has room. */
  function drawArrows() {
    const block = [1, 3, 9, 27].find((block) => block * sheet.cell >= ARROW_ROOM) ?? 27;
    const [off, part] = hasRobots() ? [0.32, 0.34] : [0, 0.9]; // beside a robot, not on it
    const own = painted.arrows(block).filter(({ place }) => sheet.has(place));
    sheet.outlined(() => {
      for (const { place, angle, share } of own) {
        sheet.arrow(sheet.at(place.map((k) => k - off)), angle, Math.max(part * share * block * sheet.cell, 5));
      }
    }, "#fff", 1.5);
  }

  function drawRobots() {
    const own = hasRobots() ? cells.filter((design) => sheet.has(middleOf(design), 0.5)) : [];
    for (const design of own) {
      const [x, y] = centre(design);
      paintRobot(sheet.pen, digitsOf(design), [x, y], 0.24 * sheet.cell);
      if (sheet.cell > 1.6 * ROBOT_CELL) sheet.write(design, x, y + 0.4 * sheet.cell, 11);
    }
    canvas.dataset.robots = own.length;
  }

  function drawPath({ designs, best, colour }, k) {
    const off = hasRobots() ? 0.36 : 0; // cells: robots are not to be hidden
    const at = (design) => sheet.at(middleOf(design).map((place) => place - off));
    const most = Math.max(...shown.paths.map((path) => path.designs.length));
    const reach = Math.min(Math.max(sheet.cell / 2, 2.6), 6);
    designs.slice(0, shown.upto).forEach((design, i) => {
      sheet.polygon(MARKERS[k], at(design), reach, evaluationColour(i / most));
    });
    const line = best.filter((one) => one.at < shown.upto).map(({ design }) => at(design));
    if (!line.length) return;
    sheet.chain(line, colour);
    sheet.write("S", ...at(designs[0]), 13);
    sheet.write("◆", ...line.at(-1), 20);
  }

  function drawTried({ designs, colour }) {
    const off = hasRobots() ? [0.3, -0.1] : [0, 0]; // robots are not to be hidden
    const places = designs.map((design) => middleOf(design).map((k, axis) => k + off[axis]));
    for (const place of places.filter((one) => sheet.has(one))) sheet.polygon(PIN, sheet.at(place), 4.5, colour);
  }

  function drawBest({ from, to }) {
    if (from !== to) {
      sheet.chain([centre(from), centre(to)]);
      sheet.write("☆", ...centre(from), 22);
    }
    sheet.write("★", ...centre(to), 24);
  }

  function drawMark([letter, design]) {
    if (!design || !sheet.has(middleOf(design))) return;
    // A mark is drawn whole even if its cell is at the edge.
    const reach = Math.max(8, sheet.cell / 2 - 2);
    const on = (k, margin) => Math.min(Math.max(k, margin), sheet.width - margin);
    const [x, y] = centre(design).map((k) => on(k, reach + 3));
    sheet.outlined((pen) => {
      if (hasRobots()) pen.rect(x - reach, y - reach, 2 * reach, 2 * reach);
      else pen.arc(x, y, reach, 0, 2 * Math.PI);
    });
    const aside = reach + 12;
    if (hasRobots()) sheet.write(letter, x - reach + 11, y - reach + 12, 18);
    else sheet.write(letter, x < sheet.width - aside - 16 ? x + aside : x - aside, y, 18);
  }

  /** Trace a cell [column, row] with a margin in pixels. */
  function traceCell(place, margin) {
    const [x, y] = sheet.at([place[0], place[1] + 1]).map((k) => k - margin);
    sheet.pen.rect(x, y, sheet.cell + 2 * margin, sheet.cell + 2 * margin);
  }

  function drawOn(pen, size) {
    sheet = new Sheet(pen, size, seen);
    drawCells();
    sheet.lines(TOP_COLOUR, Math.min(Math.max(1.8, sheet.cell / 12), 3), () => {
      for (const design of painted.top) traceCell(placeOf[design], 0);
    });
    drawRobots();
    drawArrows();
    drawTried(shown.tried);
    shown.paths.forEach(drawPath);
    if (shown.best) drawBest(shown.best);
    Object.entries(shown.marks).forEach(drawMark);
  }

  function draw() {
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawOn(pen, width);
    if (cursor) sheet.outlined(() => traceCell(cursor, 1));
    canvas.dataset.window = [seen.left, seen.bottom, seen.span].map((k) => k.toFixed(2)).join(" ");
    canvas.style.touchAction = seen.isWhole ? "pan-y" : "none"; // one finger scrolls the page, or pans
  }

  canvas.addEventListener("keydown", key);
  gestures(canvas, seen, (place) => point(place && seen.cellAt(place)), (place) => {
    point(seen.cellAt(place));
    onPick(designAt(cursor));
  });
  seen.watchers.push(draw);
  new ResizeObserver(() => {
    if (!canvas.clientWidth) return;
    [ratio, width] = [devicePixelRatio, canvas.clientWidth];
    canvas.width = canvas.height = Math.round(ratio * width);
    draw();
  }).observe(canvas);

  return {
    paint({ colour, grid, arrows, top = [] }) {
      const image = new ImageData(side, side);
      const data = image.data.fill(255);
      const diverged = [];
      cells.forEach((design) => {
        const [column, row] = placeOf[design];
        const made = colour(design);
        if (made) data.set(made, 4 * ((side - 1 - row) * side + column));
        else diverged.push(design);
      });
      pixels.getContext("2d").putImageData(image, 0, 0);
      const made = {}; // by the squares' side, made on demand
      const arrowsFor = (block) => (made[block] ??= arrows ? arrowsOf(arrows, cells, side, block) : []);
      painted = { diverged, grid, arrows: arrowsFor, top };
      canvas.dataset.outlined = top.length;
      draw();
    },
    show(what) {
      shown = { ...shown, ...what };
      draw();
    },
    picture() {
      const made = new OffscreenCanvas(PICTURE, PICTURE);
      drawOn(made.getContext("2d"), PICTURE);
      draw(); // the sheet is the page's again
      return made;
    },
  };
}

/** Places and directions of arrows, one for the mean displacement of each square of cells. */
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
    share: Math.sqrt(Math.hypot(x, y) / most), // the root keeps short arrows visible
  }));
  return made.filter(({ share }) => share > 0.2);
}
