// The map: every design a cell, with marks, a searcher's path, and a cursor for mouse and keys.

const JUMP = 9; // cells, with Shift: the side of a square two levels deep

/**
 * Make a map of a canvas; it calls onPick(design) and onPoint(design). Returns {paint, show}.
 *
 * paint({colour, grid}) colours the cells: colour(design) is [r, g, b], or null to cross it out.
 * show(what) shows over the colours: marks {letter: design}; best {from, to}, where the best went,
 * or null; path {designs, best, upto}: those evaluated, the best so far, how many to show, or null.
 */
export function landscapeMap(canvas, { side, cells }, onPick, onPoint) {
  const pen = canvas.getContext("2d");
  const pixels = new OffscreenCanvas(side, side);
  const { width } = canvas;
  const cell = width / side;
  const placeOf = []; // [column, row from the bottom] of a design
  cells.forEach((design, k) => (placeOf[design] = [k % side, Math.floor(k / side)]));
  const inside = (k) => Math.min(Math.max(k, 0), side - 1);
  let diverged = [];
  let gridColour = "#fff";
  let cursor = null; // [column, row]
  let shown = { marks: {}, best: null, path: null };

  const designAt = ([column, row]) => cells[row * side + column];

  function centre(design) {
    const [column, row] = placeOf[design];
    return [(column + 0.5) * cell, (side - row - 0.5) * cell];
  }

  function point(place) {
    cursor = place;
    draw();
    if (place) onPoint(designAt(place));
  }

  function pointAt({ clientX, clientY }) {
    const box = canvas.getBoundingClientRect();
    const shares = [(clientX - box.left) / box.width, (box.bottom - clientY) / box.height];
    point(shares.map((share) => inside(Math.floor(share * side))));
  }

  function key(event) {
    const step = event.shiftKey ? JUMP : 1;
    const move = {
      ArrowLeft: [-step, 0],
      ArrowRight: [step, 0],
      ArrowUp: [0, step],
      ArrowDown: [0, -step],
    }[event.key];
    const place = cursor ?? placeOf[shown.marks.A ?? 0];
    if (move) point(place.map((k, axis) => inside(k + move[axis])));
    else if (event.key === "Enter" || event.key === " ") onPick(designAt(place));
    else return;
    event.preventDefault();
  }

  function lines(colour, thick, trace) {
    pen.lineJoin = "round";
    pen.strokeStyle = colour;
    pen.lineWidth = thick;
    pen.beginPath();
    trace();
    pen.stroke();
  }

  /** Draw a shape in white on black, to be seen on any colour. */
  function outlined(trace) {
    lines("#000", 5, trace);
    lines("#fff", 2, trace);
  }

  function chain(places) {
    outlined(() => places.forEach((place) => pen.lineTo(...place)));
  }

  function write(text, x, y, size) {
    pen.font = `bold ${size}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.lineWidth = 4;
    pen.strokeStyle = "#000";
    pen.strokeText(text, x, y);
    pen.fillStyle = "#fff";
    pen.fillText(text, x, y);
  }

  function drawCells() {
    pen.imageSmoothingEnabled = false;
    pen.drawImage(pixels, 0, 0, width, width);
    const reach = 0.3 * cell;
    lines("#000", 1, () => {
      for (const [x, y] of diverged.map(centre)) {
        for (const slope of [1, -1]) {
          pen.moveTo(x - reach, y - slope * reach);
          pen.lineTo(x + reach, y + slope * reach);
        }
      }
    });
    for (const [parts, alpha] of [[9, 0.2], [3, 0.5]]) {
      pen.globalAlpha = alpha;
      lines(gridColour, 1, () => {
        for (let k = 1; k < parts; k++) {
          const at = Math.round((k * width) / parts);
          pen.moveTo(at, 0);
          pen.lineTo(at, width);
          pen.moveTo(0, at);
          pen.lineTo(width, at);
        }
      });
    }
    pen.globalAlpha = 1;
  }

  function drawPath({ designs, best, upto }) {
    for (const [x, y] of designs.slice(0, upto).map(centre)) {
      for (const [colour, reach] of [["#000", 3], ["#fff", 2]]) {
        pen.fillStyle = colour;
        pen.fillRect(x - reach, y - reach, 2 * reach, 2 * reach);
      }
    }
    const line = best.filter(({ at }) => at < upto).map(({ design }) => centre(design));
    if (!line.length) return;
    chain(line);
    write("◆", ...line.at(-1), 20);
  }

  function drawBest({ from, to }) {
    if (from !== to) {
      chain([centre(from), centre(to)]);
      write("☆", ...centre(from), 22);
    }
    write("★", ...centre(to), 24);
  }

  function drawMark([letter, design]) {
    if (!design) return;
    // Whole also where the cell is at the edge.
    const [x, y] = centre(design).map((at) => Math.min(Math.max(at, 11), width - 11));
    outlined(() => pen.arc(x, y, 8, 0, 2 * Math.PI));
    write(letter, x < width - 36 ? x + 20 : x - 20, Math.min(Math.max(y, 10), width - 10), 18);
  }

  function draw() {
    drawCells();
    if (shown.path) drawPath(shown.path);
    if (shown.best) drawBest(shown.best);
    Object.entries(shown.marks).forEach(drawMark);
    if (!cursor) return;
    const [left, top] = [cursor[0] * cell, (side - 1 - cursor[1]) * cell];
    outlined(() => pen.rect(left - 1, top - 1, cell + 2, cell + 2));
  }

  canvas.addEventListener("pointermove", pointAt);
  canvas.addEventListener("pointerleave", () => point(null));
  canvas.addEventListener("keydown", key);
  canvas.addEventListener("click", (event) => {
    pointAt(event);
    onPick(designAt(cursor));
  });

  return {
    paint({ colour, grid }) {
      const image = new ImageData(side, side);
      gridColour = grid;
      diverged = [];
      cells.forEach((design) => {
        const [column, row] = placeOf[design];
        const made = colour(design);
        if (!made) diverged.push(design);
        const rgb = (made ?? [255, 255, 255]).map(Math.round);
        image.data.set([...rgb, 255], 4 * ((side - 1 - row) * side + column));
      });
      pixels.getContext("2d").putImageData(image, 0, 0);
      draw();
    },
    show(what) {
      shown = { ...shown, ...what };
      draw();
    },
  };
}
