// Five steps for who has never heard of it; each is an address that the page goes to.

import { find } from "./page.js";

const LAID_OUT = 150; // ms
const TOLD = "softvox-story";

// Title, address, the panel that it is about, and what is said.
const CHAPTERS = [
  ["One voxel breathes", "design=2", "robot-panel", `A voxel is a soft cube. Every edge of this red one grows
    by 24 % and shrinks again, four times a second, as if it were pumped up. Alone it goes nowhere.`],
  ["One robot walks", "design=6453", "robot-panel", `Five voxels, four red and one passive, cyan. They push
    against the floor on one side more than on the other, so it walks: 4.66 voxel widths in 15 breaths.
    That is its fitness. Drag to look around.`],
  ["All 6561", "design=6453", "map-panel", `Eight places, each empty, passive or active, make 6561 robots.
    Every cell of the map is one, and the brighter it is the farther that robot goes. Choose some.`],
  ["Another gravity", "gravity=-1.62", "map-panel", `The same robots on the Moon: all of them are simulated
    anew, on your machine. Under the physics it then says how many of the best hundred still are.`],
  ["Another world", "b.preset=reversal", "robot-panel", `Two worlds side by side. The floor of the second holds
    by area and not by weight, and the best robot of the first walks the other way there: what a
    simulator calls good need not be good in reality.`],
];

/** Let the story be told by a button, and at once on a first visit; go(address) leads the page. */
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
    if (!step) find("story-next").focus(); // so that keys can tell it from its begin
    find("story-next").textContent = step === CHAPTERS.length - 1 ? "Done" : "Next";
    document.querySelectorAll(".told").forEach((told) => told.classList.remove("told"));
    find(panel).classList.add("told");
    go(address);
    // Where it is then: another world lays the page out anew.
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

/** Whether it was told here before; a browser may keep nothing for a page from disk. */
function remembered(isTold) {
  try {
    if (isTold) localStorage.setItem(TOLD, "1");
    return localStorage.getItem(TOLD) === "1";
  } catch {
    return false;
  }
}
