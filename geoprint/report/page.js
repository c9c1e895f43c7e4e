// The scenes of the page and their controls.

// As many scenes are kept alive at once; browsers allow about sixteen.
const MOST_LIVE = 4;

class Scene {
  constructor(root) {
    this.root = root;
    this.key = root.dataset.part;
    this.plot = root.querySelector(".plot");
    this.status = root.querySelector(".status");
    this.legend = root.querySelector(".legend");
    this.player = root.querySelector("div.player");
    this.live = false;
    this.playing = false;
    this.state = { backend: 0, colour: "spacing", paths: true, robot: false, frame: "part", time: Infinity,
      camera: firstCamera(this.plot.clientWidth) };
    this.listen();
  }

  // Unpacked when it is first needed: a part far down the page costs nothing until it comes near or is used.
  get part() {
    return this.unpacked ??= unpack(JSON.parse(document.getElementById(`${this.key}-data`).textContent));
  }

  start() {
    if (this.live || this.failed) return;
    this.readControls();
    try {
      if (!document.createElement("canvas").getContext("webgl")) throw new Error("WebGL is missing");
      const { list, legend } = traces(this.part, this.state, this.plot.clientHeight);
      this.legend.textContent = legend;
      this.ready = Plotly.newPlot(this.plot, list, layout(this.part, this.state), CONFIG).then(() => {
        this.plot.on("plotly_relayout", () => { this.state.camera = this.camera(); });
        this.root.classList.add("live");
        this.live = true;
        this.status.textContent = "Drag to turn; click once, then scroll to zoom. Keys: arrows, plus, minus, Home.";
      }).catch((error) => this.fail(error));
    } catch (error) {
      this.fail(error);
    }
  }

  fail(error) {
    this.failed = true;
    this.root.classList.add("failed");
    this.status.textContent = `This browser draws no 3D here (${error.message}); the still picture stands in.`;
  }

  stop() {
    if (!this.live) return;
    this.pause();
    this.state.camera = this.camera();
    Plotly.purge(this.plot);
    this.live = false;
    this.root.classList.remove("live");
  }

  camera() {
    return this.plot._fullLayout ? structuredClone(this.plot.layout.scene.camera) : this.state.camera;
  }

  control(name) {
    return this.root.querySelector(`[name="${this.key}-${name}"]:checked`)?.value;
  }

  get replay() {
    return this.part.backends[this.state.backend].replay;
  }

  readControls() {
    const { state } = this;
    state.backend = Number(this.control("backend"));
    state.colour = this.control("colour");
    state.paths = this.control("paths") !== undefined;
    state.frame = this.control("frame") ?? "part";
    state.robot = this.control("robot") !== undefined;
    this.showTime();
  }

  showTime() {
    if (!this.player) return;
    const { replay } = this, slider = this.player.querySelector("input");
    this.player.querySelectorAll("input, button, select").forEach((control) => { control.disabled = !replay; });
    const output = this.player.querySelector("output");
    if (!replay) { output.textContent = "not printable"; return; }
    const end = replay.times[replay.times.length - 1];
    this.state.time = (Number(slider.value) / Number(slider.max)) * end;
    const text = `${this.state.time.toFixed(1)} of ${end.toFixed(1)} s`;
    const laying = this.state.robot ? (pose(replay, this.state.time).deposit ? ", depositing" : ", travelling") : "";
    output.textContent = text + laying;
    slider.setAttribute("aria-valuetext", text);
  }

  redraw() {
    this.readControls();
    if (!this.live) return;
    const { list, legend } = traces(this.part, this.state, this.plot.clientHeight);
    this.legend.textContent = legend;
    Plotly.react(this.plot, list, layout(this.part, { ...this.state, camera: this.camera() }), CONFIG);
  }

  // Move the robot alone: the surface is not drawn anew.
  moveRobot() {
    if (!this.live || !this.replay) return;
    const { laid, arm, needle } = pose(this.replay, this.state.time);
    const points = [laid, arm, needle];
    const scene = this.plot._fullLayout.scene._scene, full = ROBOT.map((place) => this.plot._fullData[place]);
    const drawn = full.map(({ uid }) => scene?.traces?.[uid]);
    // Through plotly.js's public door every step would upload the surface again, a hundred times slower.
    if (drawn.every((trace) => typeof trace?.update === "function")) {
      drawn.forEach((trace, place) => {
        const [x, y, z] = points[place];
        trace.update({ ...full[place], x, y, z });
        // What is drawn anew when the window changes its size.
        Object.assign(this.plot.data[ROBOT[place]], { x, y, z });
      });
      scene.glplot.redraw();
      return;
    }
    const column = (axis) => points.map((each) => each[axis]);
    Plotly.restyle(this.plot, { x: column(0), y: column(1), z: column(2) }, ROBOT);
  }

  showRobot() {
    const box = this.root.querySelector(`[name="${this.key}-robot"]`);
    if (box.checked) return;
    box.checked = true;
    this.redraw();
  }

  play() {
    if (!this.replay) return;
    const slider = this.player.querySelector("input"), button = this.player.querySelector("button");
    if (Number(slider.value) >= Number(slider.max)) slider.value = 0;
    this.showRobot();
    this.playing = true;
    button.textContent = "Pause";
    const end = this.replay.times[this.replay.times.length - 1];
    let elapsed = (Number(slider.value) / Number(slider.max)) * end, last = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      elapsed += ((now - last) / 1000) * Number(this.player.querySelector("select").value);
      last = now;
      slider.value = (elapsed / end) * Number(slider.max);
      this.showTime();
      this.moveRobot();
      if (elapsed >= end) this.pause(); else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    if (this.player) this.player.querySelector("button").textContent = "Play";
  }

  listen() {
    this.root.querySelector(".controls").addEventListener("change", (event) => {
      if (event.target.name === `${this.key}-backend`) this.pause();
      if (event.target.name === `${this.key}-frame` && event.target.value === "robot") {
        this.root.querySelector(`[name="${this.key}-robot"]`).checked = true;
      }
      this.redraw();
    });
    this.root.querySelector(".reset").addEventListener("click", () => {
      this.state.camera = firstCamera(this.plot.clientWidth);
      if (this.live) Plotly.relayout(this.plot, { "scene.camera": this.state.camera });
    });
    // The wheel scrolls the page until the plot has been clicked.
    this.plot.addEventListener("mousedown", () => this.plot.focus({ preventScroll: true }), true);
    this.plot.addEventListener("wheel", (event) => {
      if (document.activeElement !== this.plot) event.stopPropagation();
    }, true);
    this.plot.addEventListener("keydown", (event) => {
      if (!this.live || event.ctrlKey || event.altKey || event.metaKey) return;
      const camera = event.key === "Home" ? firstCamera(this.plot.clientWidth) : cameraAfter(event.key, this.camera());
      if (!camera) return;
      event.preventDefault();
      Plotly.relayout(this.plot, { "scene.camera": camera });
    });
    if (!this.player) return;
    this.player.querySelector("input").addEventListener("input", () => {
      this.pause();
      this.showRobot();
      this.showTime();
      this.moveRobot();
    });
    this.player.querySelector("button").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
  }
}

document.documentElement.classList.add("scripted");

// Scenes come alive near the screen; the one left longest ago gives way.
const live = [];
const scenes = new Map([...document.querySelectorAll(".scene")].map((root) => [root, new Scene(root)]));
const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (!isIntersecting) continue;
    const scene = scenes.get(target), place = live.indexOf(scene);
    if (place >= 0) live.splice(place, 1);
    live.push(scene);
    scene.start();
    while (live.length > MOST_LIVE) live.shift().stop();
  }
}, { rootMargin: "200px" });
scenes.forEach((_, root) => watcher.observe(root));
