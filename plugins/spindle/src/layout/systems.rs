//! The equations of single orders, worked out once: every station of a run asks for the same.

use std::sync::{Arc, Mutex, PoisonError};

use runout_core::Complex64;

use super::Layout;

/// Orders that are kept, from 1: with 10 000 orders and eight sensors in three setups a few megabytes.
const KEPT: usize = 10_000;

/// The equations of one order.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// Unknowns: at order 1, [its own](Layout::first_order_unknowns).
    pub columns: usize,
    /// `[reading][unknown]`.
    pub matrix: Vec<Complex64>,
    /// Whether each of the layout's unknowns is observable.
    pub observable: Vec<bool>,
    /// Whether what the equations have of each is: at order 1, the motion that turns against the spindle.
    pub determined: Vec<bool>,
}

/// Those that were asked for. A copy begins empty, as copies are made to be changed.
#[derive(Debug, Default)]
pub(crate) struct Systems(Mutex<Vec<Arc<System>>>);

impl Clone for Systems {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Systems {
    /// The equations of the orders from 1 to `max_order`.
    pub(crate) fn up_to(&self, layout: &Layout, max_order: usize) -> Vec<Arc<System>> {
        let motions = layout.motions();
        let work_out = |order: usize| {
            let matrix = layout.matrix_with(&motions, order);
            let observable = layout.observable_with(&matrix, order);
            let (columns, matrix, determined) = if order == 1 {
                let determined = layout.determined_at_first_order();
                (layout.first_order_unknowns().len(), layout.first_order_matrix(), determined)
            } else {
                (layout.unknowns.len(), matrix, observable.clone())
            };
            Arc::new(System { columns, matrix, observable, determined })
        };
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while known.len() < max_order.min(KEPT) {
            let next = known.len() + 1;
            known.push(work_out(next));
        }
        let kept = known.iter().take(max_order).cloned();
        kept.chain((known.len() + 1..=max_order).map(work_out)).collect()
    }
}
