/* A click on a cell of the grid selects the group of its replay. */
(function () {
  "use strict";
  const cells = [...document.querySelectorAll("[data-group]")];
  const group = document.getElementById("group");
  function mark() {
    cells.forEach((cell) => {
      cell.setAttribute("aria-pressed", String(cell.dataset.group === group.selectedOptions[0].text));
    });
  }
  cells.forEach((cell) => cell.addEventListener("click", () => {
    group.value = [...group.options].find((option) => option.text === cell.dataset.group).value;
    group.dispatchEvent(new Event("change"));
    const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    document.getElementById("maps").scrollIntoView({ behavior: still ? "auto" : "smooth", block: "nearest" });
  }));
  if (cells.length) {
    group.addEventListener("change", mark);
    mark();
  }
}());
