// Colours: of the page in the light and in the dark, and of quantities by their scales, which come with the data.

const UNMEASURED = "#9a9a9a";
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

// A value for each face: of three corners the middle one, so that a class is one that is there.
function middle(faces, values) {
  const [a, b, c] = faces;
  return Float32Array.from(a, (corner, face) => {
    const x = values[corner], y = values[b[face]], z = values[c[face]];
    return Math.max(Math.min(x, y), Math.min(Math.max(x, y), z));
  });
}

// Places and colours of a scale, behind the grey of what is not measured where it has that.
function ramp({ colours, grey }) {
  if (!grey) return colours;
  const moved = colours.map(([place, colour]) => [GREY_SHARE + (1 - GREY_SHARE) * place, colour]);
  return [[0, UNMEASURED], [GREY_SHARE * 0.99, UNMEASURED], ...moved];
}

// Values for plotly.js: what is not measured falls into the grey end of the scale, everything else is kept out of it.
function shaded(part, { low, high, grey, of_faces: ofFaces }, given) {
  const below = grey ? low - (GREY_SHARE / (1 - GREY_SHARE)) * (high - low) : low;
  const kept = (value) => (Number.isNaN(value) ? below : Math.max(value, low));
  const values = ofFaces ? middle(part.faces, given) : given;
  return { intensity: values.map(kept), intensitymode: ofFaces ? "cell" : "vertex", cmin: below, cmax: high };
}

function wordsOf({ before, decimals, after, missing, classes }, value) {
  if (value === undefined || Number.isNaN(value)) return missing;
  return classes.length ? classes[value] : `${before}${value.toFixed(decimals)}${after}`;
}

// All grey: nothing is known of the backend.
const plain = (part) => ({ intensity: part.vertices[0].map(() => 0), intensitymode: "vertex", cmin: 0, cmax: 1,
  colorscale: [[0, UNMEASURED], [1, UNMEASURED]] });

// The part grey, for beads over it.
const BEADS_COLOURING = (part) => ({
  colorscale: [[0, UNMEASURED], [0.5, UNMEASURED], [0.5, BEADS], [1, BEADS]],
  values: () => plain(part),
  said: () => "the part",
  title: "beads as they are to be deposited",
  ticks: [[0.25, "part"], [0.75, "bead"]],
  legend: "Each bead as wide as it is wanted there, and half as high. Where the part shows between them it is not covered.",
});

// Colour scale and values of the surface for plotly.js, what is said of a vertex, and the scale: [place from 0 to 1, words].
function colouringOf(part, backend, name) {
  if (name === "beads") return BEADS_COLOURING(part);
  const scale = part.scales[name], values = backend[name] ?? part[name], from = scale.grey ? GREY_SHARE : 0;
  return {
    colorscale: ramp(scale),
    values: () => (values ? shaded(part, scale, values) : plain(part)),
    said: (at) => wordsOf(scale, values?.[at]),
    title: scale.title,
    ticks: scale.ticks.map(([place, words]) => [from + (1 - from) * place, words]),
    legend: scale.legend,
  };
}

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
