/** The phase of the pump: one cycle of its sine, and a dot at where it is. */

/** The picture as HTML, still without its curve: `drawWave`. */
export const PUMP = `
  <svg class="softvox-pump" viewBox="0 0 100 64" role="img" aria-label="phase of the pump">
    <path class="half" d="M4 26 H96"></path>
    <path class="wave"></path>
    <circle r="4.5"></circle>
    <text x="50" y="60" text-anchor="middle"></text>
  </svg>`;

/** Draw the curve. */
export function drawWave(svg) {
  const points = Array.from({ length: 47 }, (_, i) => [4 + 2 * i, height(i / 46)]);
  const path = `M${points.map((point) => point.join(" ")).join("L")}`;
  svg.querySelector(".wave").setAttribute("d", path);
}

/** Show how many cycles have passed, or that the robot still settles and the pump waits. */
export function showPhase(svg, cycle, settling) {
  const dot = svg.querySelector("circle");
  const phase = cycle % 1;
  dot.setAttribute("cx", 4 + 92 * phase);
  dot.setAttribute("cy", height(phase));
  svg.classList.toggle("settling", settling);
  svg.querySelector("text").textContent = settling
    ? "settling"
    : `cycle ${Math.floor(cycle + 1e-9) + 1}`;
}

/** Height of the sine in the picture. */
function height(phase) {
  return 26 - 20 * Math.sin(2 * Math.PI * phase);
}
