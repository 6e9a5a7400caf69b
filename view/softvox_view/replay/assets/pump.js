/** The phase of the pump: one cycle of its sine, and a dot at where it is. */

const sine = (phase) => 26 - 20 * Math.sin(2 * Math.PI * phase);
const WAVE = Array.from({ length: 47 }, (_, i) => `${4 + 2 * i} ${sine(i / 46)}`).join("L");

export const PUMP = `
  <svg class="softvox-pump" viewBox="0 0 100 64" role="img" aria-label="phase of the pump">
    <path stroke-dasharray="3 3" stroke-width="0.8" d="M4 26 H96"></path>
    <path stroke-width="1.6" d="M${WAVE}"></path>
    <circle r="4.5"></circle>
    <text x="50" y="60" text-anchor="middle"></text>
  </svg>`;

/** Show how many cycles have passed, or that the robot still settles and the pump waits. */
export function showPhase(svg, cycle, settling) {
  const dot = svg.querySelector("circle");
  dot.setAttribute("cx", 4 + 92 * (cycle % 1));
  dot.setAttribute("cy", sine(cycle % 1));
  svg.classList.toggle("settling", settling);
  const words = settling ? "settling" : `cycle ${Math.floor(cycle + 1e-9) + 1}`;
  svg.querySelector("text").textContent = words;
}
