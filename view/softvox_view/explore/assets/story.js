// Five steps for newcomers; each goes to an address of the page.

import { find } from "./page.js";

const LAID_OUT = 150; // ms
const TOLD = "softvox-story";

// Title, address, panel, and text.
const CHAPTERS = [
  ["One voxel breathes", "design=2", "robot-panel", `A voxel is a soft cube. Every edge of this red one grows
    by 24 % and shrinks again, four times a second, as if it were pumped up. Alone it goes nowhere.`],
  ["One robot walks", "design=6453", "robot-panel", `Five voxels: four active, red, and one passive, cyan.
    They push against the floor more on one side than on the other, so the robot walks: 4.66 voxel
    widths in 15 breaths. That is its fitness. Drag to look around.`],
  ["All 6561", "design=6453", "map-panel", `Eight places, each empty, passive or active, make 6561 robots.
    Every cell of the map is one; the brighter the cell, the further its robot goes. Choose some.`],
  ["Another gravity", "gravity=-1.62", "map-panel", `The same robots on the Moon: your machine simulates
    all of them again. The physics panel then reports how many of the best hundred remain.`],
  ["Another world", "b.preset=reversal", "robot-panel", `Two worlds side by side. The floor of the second grips
    by area instead of weight, and the best robot of the first walks the other way there: a robot that
    is good in a simulator need not be good in reality.`],
];

/** Tell the story on a button, and at once on a first visit; go(address) moves the page. */
export function story(isFirstVisit, go) {
  const card = find("story");
  let at = 0;

  function tell(step) {
    at = step;
    const [title, address, panel, text] = CHAPTERS[step];
    card.hidden = false;
    find("story-title").textContent = `${step + 1} of ${CHAPTERS.length}: ${title}`;
    find("story-text").textContent = text;
    find("story-back").disabled = !step;
    if (!step) find("story-next").focus(); // so that the keyboard reaches it from the start
    find("story-next").textContent = step === CHAPTERS.length - 1 ? "Done" : "Next";
    document.querySelectorAll(".told").forEach((told) => told.classList.remove("told"));
    find(panel).classList.add("told");
    go(address);
    // Later, because another world changes the layout of the page.
    setTimeout(() => find(panel).scrollIntoView(), LAID_OUT);
  }

  function end() {
    card.hidden = true;
    document.querySelectorAll(".told").forEach((told) => told.classList.remove("told"));
    remembered(true);
    find("tell").focus();
  }

  find("tell").addEventListener("click", () => tell(0));
  find("story-back").addEventListener("click", () => tell(at - 1));
  find("story-next").addEventListener("click", () => (at + 1 < CHAPTERS.length ? tell(at + 1) : end()));
  find("story-end").addEventListener("click", end);
  card.addEventListener("keydown", ({ key }) => key === "Escape" && end());
  if (isFirstVisit && !remembered()) tell(0);
}

/** Whether the story was told before; the browser may store nothing for a page opened from disk. */
function remembered(isTold) {
  try {
    if (isTold) localStorage.setItem(TOLD, "1");
    return localStorage.getItem(TOLD) === "1";
  } catch {
    return false;
  }
}
