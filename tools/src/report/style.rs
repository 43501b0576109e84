//! The page's style sheet, for light and dark, wide and narrow screens.

/// Style sheet of the page.
pub(super) const STYLE: &str = "
:root{color-scheme:light dark;--ground:#fbfbf9;--card:#fff;--text:#1c1e21;--quiet:#656b73;--line:#dcdfe3;--accent:#0b6e69;--good:#dff2ea;--paper:#8a5a00}
@media(prefers-color-scheme:dark){:root{--ground:#15171a;--card:#1d2024;--text:#e7e9ec;--quiet:#9aa2ac;--line:#343a41;--accent:#5cc9bf;--good:#15372f;--paper:#e0b25c}}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--text);font:16px/1.5 system-ui,sans-serif}
header,main{max-width:76rem;margin:0 auto;padding:1.2rem}
header{padding-bottom:0}
h1{font-size:1.9rem;line-height:1.2;margin:.6rem 0}
h2{font-size:1.3rem;margin:2.2rem 0 .6rem}
h3{font-size:1rem;margin:1.2rem 0 .4rem}
p{max-width:48rem;margin:.5rem 0}
a{color:var(--accent)}
nav{display:flex;flex-wrap:wrap;gap:.3rem 1.1rem;margin:1rem 0 0;border-bottom:1px solid var(--line);padding-bottom:.7rem}
nav a{text-decoration:none}
.scroll{overflow-x:auto;border:1px solid var(--line);border-radius:6px;background:var(--card)}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums;font-size:.86rem}
th,td{padding:.3rem .6rem;text-align:right;white-space:nowrap;border-bottom:1px solid var(--line);vertical-align:top}
th{font-weight:600;color:var(--quiet)}
.names th:nth-child(2),.names td:nth-child(2){text-align:left}
th:first-child,td:first-child{text-align:left;position:sticky;left:0;background:var(--card)}
tbody tr:last-child td{border-bottom:0}
.scroll:focus-visible{outline:2px solid var(--accent)}
caption{text-align:left;color:var(--quiet);font-size:.86rem;padding:.4rem .6rem;caption-side:top}
tr.group td{font-weight:600;padding-top:.7rem}
tr.group td:nth-child(n+2){font-weight:400;color:var(--quiet)}
tr.begins td{border-top:1px solid var(--line)}
td .sd{color:var(--quiet);font-size:.85em}
.paper,tr.paper td{color:var(--paper)}
.met{background:var(--good)}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(11rem,1fr));gap:.7rem;margin:1rem 0}
.tile,.card{border:1px solid var(--line);border-radius:6px;background:var(--card);padding:.7rem .9rem}
.tile b{display:block;font-size:1.35rem;font-variant-numeric:tabular-nums}
.tile span{color:var(--quiet);font-size:.86rem}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(17rem,1fr));gap:.7rem}
.card h3{margin:.1rem 0 .5rem}
.card label{display:block;font-size:.86rem;color:var(--quiet);margin:.3rem 0}
audio{display:block;width:100%;height:2.2rem}
figure{margin:1rem 0}
figure img{display:block;width:100%;min-width:40rem;background:#fff}
figcaption{color:var(--quiet);font-size:.9rem;max-width:76rem;margin-top:.3rem}
dl{display:grid;grid-template-columns:minmax(8rem,max-content) 1fr;gap:.3rem 1.2rem}
dt{color:var(--quiet)}dd{margin:0;overflow-wrap:anywhere}
code{font-size:.9em}
@media(max-width:40rem){body{font-size:15px}header,main{padding:.8rem}h1{font-size:1.45rem}dl{grid-template-columns:1fr}dd{margin-bottom:.4rem}}
";
