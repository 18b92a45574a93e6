//! A report as data; SVG and HTML made from it.
