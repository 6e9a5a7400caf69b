/** Mouse, touch and keys on a player's canvas. */

const ORBIT_PER_PIXEL = 0.4; // degrees
const ORBIT_PER_KEY = 5; // degrees
const ZOOM_PER_KEY = 1.1;

export const HELP = `drag or arrow keys: orbit; wheel, pinch, + and -: zoom; space: play or pause;
, and .: one frame back or forward; F: follow; Home: the initial view`;

const KEYS = {
  ArrowLeft: (player) => player.turn(-ORBIT_PER_KEY, 0),
  ArrowRight: (player) => player.turn(ORBIT_PER_KEY, 0),
  ArrowUp: (player) => player.turn(0, ORBIT_PER_KEY),
  ArrowDown: (player) => player.turn(0, -ORBIT_PER_KEY),
  "+": (player) => player.zoom(ZOOM_PER_KEY),
  "=": (player) => player.zoom(ZOOM_PER_KEY),
  "-": (player) => player.zoom(1 / ZOOM_PER_KEY),
  ",": (player) => player.step(-1),
  ".": (player) => player.step(1),
  " ": (player) => player.toggle(),
  f: (player) => (player.view = { follow: !player.view.follow }),
  Home: (player) => player.reset(),
};

/** Connect the input on a player's canvas until a signal aborts. */
export function listen(canvas, player, signal) {
  const pointers = new Map();
  const on = (type, handler) => canvas.addEventListener(type, handler, { signal, passive: false });
  on("keydown", (event) => {
    const action = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action(player);
  });
  on("wheel", (event) => {
    // The wheel may be meant for the page, if that scrolls or is part of another.
    const isAlone = self === top && document.scrollingElement.scrollHeight <= innerHeight;
    if (!isAlone && document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    const lines = event.deltaMode === 0 ? event.deltaY / 40 : event.deltaY;
    player.zoom(ZOOM_PER_KEY ** -Math.min(Math.max(lines, -4), 4));
  });
  on("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
  });
  on("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const spread = () => {
      const [a, b] = [...pointers.values()];
      return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY) || 1;
    };
    const apart = pointers.size === 2 && spread();
    pointers.set(event.pointerId, event);
    if (apart) {
      player.zoom(spread() / apart);
    } else if (pointers.size === 1) {
      const [x, y] = [event.clientX - before.clientX, event.clientY - before.clientY];
      player.turn(-x * ORBIT_PER_PIXEL, y * ORBIT_PER_PIXEL);
    }
  });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
    on(type, (event) => pointers.delete(event.pointerId));
  }
}
