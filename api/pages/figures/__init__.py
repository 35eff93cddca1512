"""Figures as SVG: every one a function of plain arrays that returns markup; colours come from `figures.css`."""
