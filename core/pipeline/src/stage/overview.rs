//! What is to be read of many results or of none: a batch, a comparison, a plan.

use runout_turning::rig::Rig;

/// Text and tables of a page whose numbers are not one result's.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Overview {
    /// The most important in one sentence.
    pub headline: String,
    /// The rig, where it is about one.
    pub rig: Option<Rig>,
    /// What else there is to read, in its order.
    pub sections: Vec<Section>,
}

/// A part of an [`Overview`] under a heading.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// Its heading.
    pub heading: String,
    /// What it holds, in its order.
    pub parts: Vec<Part>,
}

/// A part of a [`Section`].
#[derive(Debug, Clone, PartialEq)]
pub enum Part {
    /// Lines of text.
    Lines(Vec<String>),
    /// Items of a list.
    List(Vec<String>),
    /// A table.
    Table {
        /// Columns of words, at the left; the others are numbers.
        words: usize,
        /// Names of the columns.
        header: Vec<String>,
        /// Cells, as many a row as there are columns.
        rows: Vec<Vec<String>>,
    },
}
