// Five steps for who has never heard of it; each is an address that the page goes to.

import { find } from "./page.js";

const TOLD = "softvox-story";

const CHAPTERS = [
  {
    title: "One voxel breathes",
    address: "design=2",
    panel: "robot-panel",
    text: `A voxel is a soft cube. Every edge of this red one grows by 24 % and shrinks again, four times
      a second, as if it were pumped up. Alone it goes nowhere. Press play, and drag to look around.`,
  },
  {
    title: "One robot walks",
    address: "design=6453",
    panel: "robot-panel",
    text: `Five voxels, four red and one passive, cyan. Their pushing against the floor is not the same
      on all sides, so it walks: 4.66 voxel widths in 15 breaths, which is its fitness.`,
  },
  {
    title: "All 6561",
    address: "",
    panel: "map-panel",
    text: `Eight places, each empty, passive or active, make 6561 robots. Every cell of the map is one,
      and the brighter it is the farther that robot goes. Click a few.`,
  },
  {
    title: "Another gravity",
    address: "gravity=-1.62",
    panel: "map-panel",
    text: `The same robots on the Moon. All of them are simulated anew, here, on your machine; the
      physics panel tells how many of the best hundred are still among the best.`,
  },
  {
    title: "Another world",
    address: "b.preset=reversal",
    panel: "robot-panel",
    text: `Two worlds side by side. The floor of the second holds by area instead of by weight, and the
      robot that was best in the first walks the other way there: what a simulator calls good need not
      be good in reality.`,
  },
];

/** Let the story be told by a button, and at once on a first visit; go(address) leads the page. */
export function story(isFirstVisit, go) {
  const card = find("story");
  let at = 0;

  function tell(step) {
    at = step;
    const { title, text, address, panel } = CHAPTERS[step];
    card.hidden = false;
    find("story-title").textContent = `${step + 1} of ${CHAPTERS.length}: ${title}`;
    find("story-text").textContent = text;
    find("story-back").disabled = !step;
    find("story-next").textContent = step === CHAPTERS.length - 1 ? "Done" : "Next";
    document.querySelectorAll(".told").forEach((told) => told.classList.remove("told"));
    find(panel).classList.add("told");
    find(panel).scrollIntoView({ block: "nearest" });
    go(address);
  }

  function end() {
    card.hidden = true;
    document.querySelectorAll(".told").forEach((told) => told.classList.remove("told"));
    remembered(true);
    find("tell").focus();
  }

  find("tell").addEventListener("click", () => {
    tell(0);
    find("story-next").focus();
  });
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
