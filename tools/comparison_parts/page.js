"use strict";
// Each wipe shows two of its scene's pictures, one over the other, cut off where its slider stands. The slider is the
// browser's own, so that keys move it; a pointer on the picture moves it, too.
for (const wipe of document.querySelectorAll(".wipe")) {
  const sheet = wipe.closest("section").querySelector(".sheet");
  const slider = wipe.querySelector("input");
  const stage = wipe.querySelector(".stage");
  for (const side of ["left", "right"]) {
    const chosen = wipe.querySelector(`select.${side}`);
    const picture = stage.querySelector(`img.${side}`);
    const show = () => {
      picture.src = sheet.querySelector(`img[data-method="${CSS.escape(chosen.value)}"]`).src;
      picture.alt = `by ${chosen.value}`;
    };
    chosen.addEventListener("change", show);
    show();
  }
  const place = () => stage.style.setProperty("--at", `${slider.value}%`);
  slider.addEventListener("input", place);
  place();
  const follow = (event) => {
    const box = stage.getBoundingClientRect();
    slider.value = (100 * (event.clientX - box.left)) / box.width;
    place();
  };
  stage.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    stage.setPointerCapture(event.pointerId);
    slider.focus({ preventScroll: true });
    follow(event);
  });
  stage.addEventListener("pointermove", (event) => {
    if (stage.hasPointerCapture(event.pointerId)) follow(event);
  });
}
