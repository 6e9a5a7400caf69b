// The map: every design a cell, with marks, a searcher's path, and a cursor for mouse and keys.

const MARKS = { design: "A", compare: "B" };
const JUMP = 9; // cells, with Shift: the side of a square two levels deep

/** The map on its canvas. Events: "point" and "pick", with detail {design}. */
export class LandscapeMap {
  #canvas;
  #pen;
  #side;
  #cells; // the design of a cell, row by row from the bottom
  #placeOf = []; // [column, row] of a design
  #pixels;
  #grid = "#fff";
  #diverged = [];
  #cursor = null; // [column, row]
  #shown = { marks: {}, best: null, path: null };

  constructor(canvas, { side, cells }) {
    this.#canvas = canvas;
    this.#pen = canvas.getContext("2d");
    this.#side = side;
    this.#cells = cells;
    cells.forEach((design, k) => (this.#placeOf[design] = [k % side, Math.floor(k / side)]));
    this.#pixels = new OffscreenCanvas(side, side);
    canvas.addEventListener("pointermove", (event) => this.#point(this.#under(event)));
    canvas.addEventListener("pointerleave", () => this.#point(null));
    canvas.addEventListener("click", (event) => {
      const place = this.#under(event);
      this.#point(place);
      this.#announce("pick", place);
    });
    canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  /** Colour the cells: colour(design) -> [r, g, b], or null to cross it out; grid is a colour. */
  paint({ colour, grid }) {
    const image = new ImageData(this.#side, this.#side);
    this.#grid = grid;
    this.#diverged = [];
    this.#cells.forEach((design, k) => {
      const row = this.#side - 1 - Math.floor(k / this.#side);
      const at = 4 * (row * this.#side + (k % this.#side));
      const made = colour(design);
      if (!made) this.#diverged.push(design);
      image.data.set([...(made ?? [255, 255, 255]).map(Math.round), 255], at);
    });
    this.#pixels.getContext("2d").putImageData(image, 0, 0);
    this.draw();
  }

  /**
   * Show over the colours: marks {design, compare}; best {from, to}, where the best went, or null;
   * path {designs, best, upto}: those evaluated, the best so far, and how many to show, or null.
   */
  show(what) {
    Object.assign(this.#shown, what);
    this.draw();
  }

  draw() {
    const { width, height } = this.#canvas;
    this.#pen.imageSmoothingEnabled = false;
    this.#pen.drawImage(this.#pixels, 0, 0, width, height);
    this.#drawDiverged();
    this.#drawGrid();
    const { marks, best, path } = this.#shown;
    if (path) this.#drawPath(path);
    if (best) this.#drawBest(best);
    for (const [name, letter] of Object.entries(MARKS)) {
      if (marks[name]) this.#label(marks[name], letter);
    }
    if (this.#cursor) this.#frame(this.#cursor);
  }

  get #cell() {
    return this.#canvas.width / this.#side;
  }

  #centre(design) {
    const [column, row] = this.#placeOf[design];
    return [(column + 0.5) * this.#cell, (this.#side - row - 0.5) * this.#cell];
  }

  #under(event) {
    const box = this.#canvas.getBoundingClientRect();
    const share = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    const [column, down] = share.map((s) => Math.floor(s * this.#side));
    const isInside = [column, down].every((k) => k >= 0 && k < this.#side);
    return isInside ? [column, this.#side - 1 - down] : null;
  }

  #point(place) {
    this.#cursor = place;
    this.draw();
    this.#announce("point", place);
  }

  #announce(type, place) {
    if (!place) return;
    const detail = { design: this.#cells[place[1] * this.#side + place[0]] };
    this.#canvas.dispatchEvent(new CustomEvent(type, { detail }));
  }

  #key(event) {
    const step = event.shiftKey ? JUMP : 1;
    const moves = {
      ArrowLeft: [-step, 0],
      ArrowRight: [step, 0],
      ArrowUp: [0, step],
      ArrowDown: [0, -step],
    };
    const place = this.#cursor ?? this.#placeOf[this.#shown.marks.design ?? 0];
    if (event.key === "Enter" || event.key === " ") {
      this.#announce("pick", place);
    } else if (event.key in moves) {
      const inside = (k) => Math.min(Math.max(k, 0), this.#side - 1);
      this.#point(place.map((k, axis) => inside(k + moves[event.key][axis])));
    } else {
      return;
    }
    event.preventDefault();
  }

  #drawDiverged() {
    const pen = this.#pen;
    const reach = 0.3 * this.#cell;
    pen.strokeStyle = "#000";
    pen.lineWidth = 1;
    pen.beginPath();
    for (const [x, y] of this.#diverged.map((design) => this.#centre(design))) {
      for (const slope of [1, -1]) {
        pen.moveTo(x - reach, y - slope * reach);
        pen.lineTo(x + reach, y + slope * reach);
      }
    }
    pen.stroke();
  }

  #drawGrid() {
    const pen = this.#pen;
    pen.strokeStyle = this.#grid;
    pen.lineWidth = 1;
    for (const [parts, alpha] of [[9, 0.2], [3, 0.5]]) {
      pen.globalAlpha = alpha;
      pen.beginPath();
      for (let k = 1; k < parts; k++) {
        const at = Math.round((k * this.#canvas.width) / parts);
        pen.moveTo(at, 0);
        pen.lineTo(at, this.#canvas.height);
        pen.moveTo(0, at);
        pen.lineTo(this.#canvas.width, at);
      }
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  /** Draw a shape in white on black, to be seen on any colour. */
  #outlined(trace, width = 2) {
    const pen = this.#pen;
    pen.lineJoin = "round";
    for (const [colour, wide] of [["#000", width + 3], ["#fff", width]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = wide;
      pen.beginPath();
      trace(pen);
      pen.stroke();
    }
  }

  #frame([column, row]) {
    const c = this.#cell;
    const [x, y] = [column * c, (this.#side - 1 - row) * c];
    this.#outlined((pen) => pen.rect(x - 1, y - 1, c + 2, c + 2));
  }

  #label(design, letter) {
    const pen = this.#pen;
    const [x, y] = this.#centre(design);
    this.#outlined((p) => p.arc(x, y, 8, 0, 2 * Math.PI));
    const left = x < this.#canvas.width - 36 ? x + 20 : x - 20;
    this.#words(letter, left, Math.min(Math.max(y, 10), this.#canvas.height - 10), 18);
    pen.textAlign = "start";
  }

  #words(text, x, y, size) {
    const pen = this.#pen;
    pen.font = `bold ${size}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.lineWidth = 4;
    pen.strokeStyle = "#000";
    pen.strokeText(text, x, y);
    pen.fillStyle = "#fff";
    pen.fillText(text, x, y);
  }

  #drawBest({ from, to }) {
    const [a, b] = [this.#centre(from), this.#centre(to)];
    if (from !== to) {
      this.#outlined((pen) => {
        pen.moveTo(...a);
        pen.lineTo(...b);
      });
      this.#words("☆", ...a, 22);
    }
    this.#words("★", ...b, 24);
  }

  #drawPath({ designs, best, upto }) {
    const pen = this.#pen;
    designs.slice(0, upto).forEach((design) => {
      const [x, y] = this.#centre(design);
      pen.fillStyle = "#000";
      pen.fillRect(x - 3, y - 3, 6, 6);
      pen.fillStyle = "#fff";
      pen.fillRect(x - 2, y - 2, 4, 4);
    });
    const line = best.filter(({ at }) => at < upto).map(({ design }) => this.#centre(design));
    if (!line.length) return;
    this.#outlined((p) => line.forEach(([x, y], k) => (k ? p.lineTo(x, y) : p.moveTo(x, y))));
    this.#words("◆", ...line.at(-1), 20);
  }
}
