// What the page does by itself: it moves the arm smoothly between the server's messages, says every 0.1 s that a
// button is still held, takes the keys for stop, and covers itself when the server falls silent.
window.armtempo = {
  parts: null,
  from: null,
  to: null,
  ghost: null,
  since: 0,
  heard: performance.now(),
  held: null,
  SMOOTH_MS: 100,
  SILENT_MS: 900,

  begin(parts) {
    this.parts = parts;
    requestAnimationFrame(() => this.draw());
    setInterval(() => this.look(), 100);
    addEventListener("keydown", (event) => {
      const typing = /INPUT|TEXTAREA|SELECT/.test(event.target.tagName);
      if (event.key === "Escape" || (event.key === " " && !typing)) {
        event.preventDefault();
        if (!event.repeat) emitEvent("armtempo-stop");
      }
    });
    for (const gone of ["pointerup", "pointercancel", "blur"]) addEventListener(gone, () => this.release());
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
  },

  // a message of the server, about ten a second
  hear(message) {
    this.heard = performance.now();
    document.body.classList.remove("lost");
    this.from = this.now();
    this.to = message.links;
    this.since = performance.now();
    for (const [id, text] of Object.entries(message.texts || {})) {
      const element = document.getElementById(id);
      if (element && element.textContent !== text) element.textContent = text;
    }
  },

  now() {
    if (!this.to) return null;
    if (!this.from) return this.to;
    const part = Math.min(1, (performance.now() - this.since) / this.SMOOTH_MS);
    return this.to.map((pose, i) => pose.map((value, k) => {
      const before = this.from[i];
      const sign = k > 2 && [3, 4, 5, 6].reduce((sum, n) => sum + before[n] * pose[n], 0) < 0 ? -1 : 1;
      return before[k] * sign + (value - before[k] * sign) * part;
    }));
  },

  draw() {
    const scene = this.parts && getElement(this.parts.scene);
    if (scene && scene.objects) {
      if (scene.renderer) scene.renderer.setClearColor(0x000000, 0); // as the page, light or dark
      this.place(scene, this.parts.links, this.now());
      this.place(scene, this.parts.ghost, this.ghost);
    }
    requestAnimationFrame(() => this.draw());
  },

  place(scene, ids, poses) {
    ids.forEach((id, i) => {
      const found = scene.objects.get(id);
      if (!found || !found.mesh) return;
      found.mesh.visible = Boolean(poses);
      if (!poses) return;
      found.mesh.position.set(...poses[i].slice(0, 3));
      found.mesh.quaternion.set(...poses[i].slice(3)).normalize();
    });
  },

  press(button) {
    this.held = button;
    emitEvent("armtempo-press", button);
  },

  release() {
    if (this.held === null) return;
    this.held = null;
    emitEvent("armtempo-release");
  },

  look() {
    if (this.held !== null) emitEvent("armtempo-held");
    if (performance.now() - this.heard > this.SILENT_MS) {
      this.held = null;
      document.body.classList.add("lost");
    }
  },
};
