// Colour maps as evenly spaced anchors: cividis (Nunez et al., 2018) is perceptually uniform and made
// for the colour-blind, twilight is cyclic, PuOr (ColorBrewer, Apache 2.0) has neither red nor green.

export const cividis = anchors(`
  00224e 00285b 002e6a 053371 1a386f 273e6e 32436d 3b496c 434e6c 4b546c 535a6d 5a5f6e
  61656f 686a71 6f7073 767676 7d7c78 848279 8c8878 938e78 9b9476 a39a74 aba072 b4a76f
  bcae6c c4b468 cdbb63 d5c25e dec958 e7d150 f0d846 f9e03a fee838`);

export const twilight = anchors(`
  e2d9e2 d7d7dd c4ced4 acc2cc 95b5c7 81a6c3 7297c1 6887be 6276ba 5f64b5 5e51ad 5d3da1
  592a8f 511b77 45135c 381145 2f1436 3a113a 4a1342 5f174a 741e4f 872750 983550 a64550
  b25652 bb6958 c27c63 c89073 cca389 d1b6a3 d8c7be dfd4d6 e2d9e2`);

export const puOr = anchors(`
  2d004b 390c5e 451871 522584 5f3a91 6d529c 7b6aa8 8a7eb3 9990bf a9a1cb b7b1d5 c3c0dd
  cfcfe5 dadcec e4e5f0 eeeef3 f7f7f6 f9efe1 fce8cd fee1b9 fed59f fdc885 fdbc6b f7ac52
  ee9b39 e58a20 d97b12 cb6e0d bd6109 ae5506 9e4c07 8d4307 7f3b08`);

function anchors(text) {
  return text
    .trim()
    .split(/\s+/)
    .map((hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)));
}

/** The colour [r, g, b] of a share from 0 to 1. */
export function sample(palette, share) {
  const place = Math.min(Math.max(share, 0), 1) * (palette.length - 1);
  const i = Math.min(Math.floor(place), palette.length - 2);
  return palette[i].map((low, k) => low + (place - i) * (palette[i + 1][k] - low));
}
