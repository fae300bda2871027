//! `[[effect]]`: effects of the pipeline's own, beside those that are registered.

use std::sync::Arc;

use runout_error::fault::Fault;

use crate::{
    effects::{EffectCatalogue, PointEffect},
    pipeline::{
        document::{self, Table, tables},
        registry::{Context, Registry},
    },
    stage::SourceKind,
};

/// The registered effects, and the pipeline's own.
pub(super) fn effects(
    root: &Table,
    registry: &Registry,
    context: &Context,
    kind: SourceKind,
) -> Result<EffectCatalogue, Fault> {
    let mut effects = registry.effects.clone();
    for table in tables(root, "effect")? {
        let effect = registry.own_effects.build(&table, context)?;
        if effects.iter().any(|known| known.name == effect.name) {
            let fault = Fault::at("id", format!("there is an effect `{}` already", effect.name));
            return Err(document::resolve(fault.help("give it another id"), &table));
        }
        let refused = match (kind, effect.is::<Arc<dyn PointEffect>>()) {
            (SourceKind::Points, false) => {
                Fault::span(table.span(), "it changes a channel of turns, and [load] gives measured points")
                    .help("an effect of points names the columns that it takes: columns = [\"temperature_k\"]")
            }
            (SourceKind::Turns, true) => {
                Fault::at("columns", "turns have no columns").help("leave `columns` and `labels` out")
            }
            _ => {
                effects.add(effect);
                continue;
            }
        };
        return Err(document::resolve(refused, &table));
    }
    Ok(effects)
}
