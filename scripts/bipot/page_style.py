"""How the page of a result looks, on a screen and printed."""

STYLE = """\
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; margin: 0 auto;
  max-width: 78rem; padding: 1rem 1.25rem 3rem; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 1rem 0 0.25rem; }
h2 { font-size: 1.2rem; margin: 2.25rem 0 0.5rem; border-bottom: 1px solid #ccc; }
p.about { color: #555; margin: 0 0 0.75rem; }
p.good { color: #14622f; font-weight: 600; }
p.bad { color: #9c1c1c; font-weight: 600; }
li.bad { color: #9c1c1c; }
nav a { margin-right: 1rem; white-space: nowrap; }
a { color: #1f5a96; }
figure { margin: 1.25rem 0; break-inside: avoid; }
figure img { display: block; max-width: 100%; height: auto; }
figcaption { color: #444; font-size: 0.9rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.85rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; color: #444; padding: 0.25rem 0; }
th, td { padding: 0.15rem 0.6rem; border-bottom: 1px solid #ddd; text-align: right;
  vertical-align: top; }
thead th { border-bottom: 2px solid #999; vertical-align: bottom; }
th.text, td.text { text-align: left; }
#resultants td:nth-child(n+3) { white-space: nowrap; }
#resultants th, #resultants td { padding: 0.15rem 0.35rem; }
#plan-table td.text:first-child, #plan-table td.text:nth-child(2) { white-space: nowrap; }
table.narrow { font-size: 0.78rem; }
table.narrow th, table.narrow td { padding: 0.15rem 0.3rem; white-space: nowrap; }
table.narrow thead th:nth-child(n+4) { writing-mode: vertical-rl; transform: rotate(180deg);
  text-align: left; margin: auto; }
@media (max-width: 60rem) {
  #resultants td:nth-child(n+3), table.narrow td:nth-child(2) { white-space: normal; }
  table, table.narrow { font-size: 0.7rem; }
  th, td, #resultants th, #resultants td, table.narrow th, table.narrow td {
    padding: 0.15rem 0.15rem; }
}
.deck pre { margin: 0.25rem 0; }
.deck details { margin-left: 1rem; }
.deck summary { font: 0.8rem/1.35 monospace; }
tr.bad td { background: #fbe9e7; }
pre { background: #f6f6f4; padding: 0.75rem; overflow-x: auto; font-size: 0.8rem;
  line-height: 1.35; }
summary { cursor: pointer; }
@media print {
  body { max-width: none; padding: 0; font-size: 10.5pt; }
  nav { display: none; }
  details::details-content { content-visibility: visible; height: auto; }
  table, table.narrow { font-size: 7pt; }
  #resultants td:nth-child(n+3) { white-space: normal; }
  th, td { padding: 0.1rem 0.25rem; }
  .wide { overflow: visible; }
  pre { overflow: visible; white-space: pre-wrap; }
  tr, figure { break-inside: avoid; }
  h2 { break-after: avoid; }
}
"""
