// Colours: of the page in the light and in the dark, and a scale for each quantity.

// Light to dark, so that dark paths stay visible on it and colour-blind readers can follow.
const DISTANCE = ["#fff7d6", "#d3ebb9", "#8fd0bd", "#4aa6c3", "#2f76b5"];
// Red: too close, blue: too far; the same scale as in the still pictures.
const SPACING = ["#b2182b", "#ef8a62", "#fddbc7", "#f4f4f2", "#d1e5f0", "#67a9cf", "#2166ac"];
const LEAN = ["#f7f4f9", "#d4b9da", "#df65b0", "#ce1256", "#67001f"];
const PACE = ["#67001f", "#b2182b", "#d6604d", "#f4a582", "#fddbc7", "#f4f4f2"];
// What level ground carries, and what overhangs.
const OVERHANG = { carried: ["#f7fbff", "#9ecae1"], beyond: ["#fdae6b", "#d94801", "#7f2704"] };
// The scale of leans reaches so far at least [degrees].
const LEAST_LEAN = 1;
const UNMEASURED = "#9a9a9a";
const COVERAGE = ["#dde2e6", "#d55e00", "#0072b2"];
const COVERAGE_WORDS = ["covered", "gap", "overlap"];
// Share of the colour scale that stands for what was not measured.
const GREY_SHARE = 0.06;
// Paths and beads lie on the surface, whose colours are the same in the dark.
const PATH = "#17212b", BEAD = "#111111", PATH_BELOW = "#8d99a3", BEADS = "#d9a441";
const FONT = "system-ui, sans-serif";

// What the style sheet says for the light or the dark.
function theme() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(["ink", "soft", "rule", "stage", "arm", "tool", "laying", "cell", "body"].map((name) =>
    [name, style.getPropertyValue(`--${name}`).trim()]));
}

function evenly(colours, from = 0) {
  return colours.map((colour, place) => [from + ((1 - from) * place) / (colours.length - 1), colour]);
}

// A value for each face: of three corners the middle one, so that a class is one that is there.
function middle(faces, values) {
  const [a, b, c] = faces;
  return Float32Array.from(a, (corner, face) => {
    const x = values[corner], y = values[b[face]], z = values[c[face]];
    return Math.max(Math.min(x, y), Math.min(Math.max(x, y), z));
  });
}

// What a motion does at the vertices; where none was planned the surface is grey.
function ofMotion(backend, values, high) {
  return values
    ? { intensity: values, intensitymode: "vertex", cmin: 0, cmax: high }
    : { intensity: backend.distance, intensitymode: "vertex", colorscale: [[0, UNMEASURED], [1, UNMEASURED]] };
}

// The lower end of a scale of ratios with the grey of what is not measured below it.
const greyOf = ([low, high]) => low - (GREY_SHARE / (1 - GREY_SHARE)) * (high - low);

// Ratios to what is wanted: what is not measured falls into the grey end of the scale, everything else is kept out of it.
function ofRatios(part, ratios, range, colours) {
  const [low, high] = range, grey = greyOf(range);
  const kept = (value) => (Number.isNaN(value) ? grey : Math.max(value, low));
  return {
    colorscale: [[0, UNMEASURED], [GREY_SHARE * 0.99, UNMEASURED], ...evenly(colours, GREY_SHARE)],
    values: () => ({ intensity: middle(part.faces, ratios).map(kept), intensitymode: "cell", cmin: grey, cmax: high }),
  };
}

function ticksOf(range, ticks) {
  const grey = greyOf(range);
  return ticks.map(([value, words]) => [(value - grey) / (range[1] - grey), words]);
}

// Colour scale and values of the surface for plotly.js, what is said of a vertex, and the scale: [place from 0 to 1, words].
const COLOURINGS = {
  distance: (part, backend) => ({
    colorscale: evenly(DISTANCE),
    values: () => ({ intensity: backend.distance, intensitymode: "vertex", cmin: 0, cmax: part.farthest }),
    said: (at) => `${backend.distance[at].toFixed(2)} mm from border or source`,
    title: "distance from border or source [mm]",
    ticks: [0, 0.5, 1].map((share) => [share, (share * part.farthest).toFixed(1)]),
    legend: "Light: near the source, dark: far from it, as this backend measures.",
  }),
  spacing: (part, backend) => {
    const [low, high] = part.ratios, half = (end) => [(1 + end) / 2, ((1 + end) / 2).toFixed(1)];
    return {
      ...ofRatios(part, backend.spacing, part.ratios, SPACING),
      said: (at) => Number.isNaN(backend.spacing[at])
        ? "no neighbouring path" : `spacing ${backend.spacing[at].toFixed(3)} of the wanted one`,
      title: "local spacing / wanted spacing [1]",
      ticks: ticksOf(part.ratios, [[low, `≤ ${low}`], half(low), [1, "1"], half(high), [high, `≥ ${high}`]]),
      legend: "Red: paths too close, blue: too far apart, white: as wanted. Grey: no neighbour.",
    };
  },
  thickness: (part, backend) => {
    const [low, high] = part.thicknesses, { what, of, legend } = part.said;
    const between = [(low + 1) / 2, (1 + high) / 2].map((value) => [value, value.toFixed(2)]);
    return {
      ...ofRatios(part, backend.thickness, part.thicknesses, [...SPACING].reverse()),
      said: (at) => Number.isNaN(backend.thickness[at])
        ? "not judged" : `${what} ${backend.thickness[at].toFixed(3)} of the ${of} one`,
      title: `${what} / ${of} thickness [1]`,
      ticks: ticksOf(part.thicknesses, [[low, `≤ ${low}`], between[0], [1, "1"], between[1], [high, `≥ ${high}`]]),
      legend,
    };
  },
  overhang: (part) => {
    const { critical, overhang } = part, bound = critical / 180;
    return {
      colorscale: [...evenly(OVERHANG.carried).map(([at, colour]) => [at * bound * 0.999, colour]),
        ...evenly(OVERHANG.beyond, bound)],
      values: () => ({ intensity: overhang, intensitymode: "vertex", cmin: 0, cmax: 180 }),
      said: (at) => `${overhang[at].toFixed(1)} degrees from upright`,
      title: "surface normal from upright [degrees]",
      ticks: [0, critical, 90, 180].map((angle) => [angle / 180, `${Number(angle.toFixed(1))}`]),
      legend: `Red: farther than ${Number(critical.toFixed(1))} degrees from upright, where a bead overhangs as the part stands.`,
    };
  },
  coverage: (part, backend) => ({
    colorscale: COVERAGE.flatMap((colour, place) => [[place / 3, colour], [(place + 1) / 3, colour]]),
    values: () => ({ intensity: middle(part.faces, backend.coverage), intensitymode: "cell", cmin: -0.5, cmax: 2.5 }),
    said: (at) => COVERAGE_WORDS[backend.coverage[at]],
    title: "coverage of the surface",
    ticks: COVERAGE_WORDS.map((word, place) => [(place + 0.5) / 3, word]),
    legend: "Orange: farther than 0.55 spacings from every path. Blue: within 0.45 spacings of two stretches of path.",
  }),
  beads: (part, backend) => ({
    // Distances end below the middle of the scale: the part is grey all over.
    colorscale: [[0, UNMEASURED], [0.5, UNMEASURED], [0.5, BEADS], [1, BEADS]],
    values: () => ({ intensity: backend.distance, intensitymode: "vertex", cmin: 0, cmax: 3 * part.farthest }),
    said: () => "the part",
    title: "beads as they are to be laid",
    ticks: [[0.25, "part"], [0.75, "bead"]],
    legend: "Each bead as wide as it is wanted there, and half as high. Where the part shows between them it is not covered.",
  }),
  lean: (part, backend) => ({
    colorscale: evenly(LEAN),
    values: () => ofMotion(backend, backend.lean, Math.max(part.leaning, LEAST_LEAN)),
    said: (at) => backend.lean ? `nozzle ${backend.lean[at].toFixed(1)} degrees from the surface normal` : "not printable",
    title: "nozzle from the surface normal [degrees]",
    ticks: [0, 0.5, 1].map((share) => [share, (share * Math.max(part.leaning, LEAST_LEAN)).toFixed(1)]),
    legend: "Light: the nozzle stands upright on the surface, dark: it leans, for room or so that the joints hold the speed. Grey: no motion.",
  }),
  speed: (part, backend) => ({
    colorscale: evenly(PACE),
    values: () => ofMotion(backend, backend.speed, 1),
    said: (at) => backend.speed ? `deposited at ${(100 * backend.speed[at]).toFixed(0)} % of the print's speed` : "not printable",
    title: "speed / speed of the print [1]",
    ticks: [[0, "0"], [0.5, "0.5"], [1, "1"]],
    legend: "Light: as set, dark red: slower, at the ends of runs and where joints or targets hold the tip back. Grey: no motion.",
  }),
};

// The scale as elements, once for all views.
function scaleOf({ colorscale, title, ticks, legend }) {
  const made = (name, text, style) => {
    const one = document.createElement(name === "p" ? "p" : "span");
    one.className = name;
    one.textContent = text;
    Object.assign(one.style, style);
    return one;
  };
  const ramp = made("ramp", "", {
    background: `linear-gradient(90deg, ${colorscale.map(([at, colour]) => `${colour} ${100 * at}%`).join(", ")})`,
  });
  const row = made("ticks", "");
  row.append(...ticks.map(([share, words]) => made("tick", words, { left: `${100 * share}%` })));
  const scale = made("scale", "");
  scale.append(made("scale-title", title), ramp, row);
  const said = document.createElement("small");
  said.textContent = legend;
  return [scale, said];
}
