//! `[[effect]]`: effects of the pipeline's own, beside those that are registered.

use runout_error::fault::Fault;

use crate::{
    effects::EffectCatalogue,
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
        if kind == SourceKind::Points {
            let fault = Fault::span(table.span(), "measured points take no [[effect]]: it changes a channel of turns");
            return Err(fault.help("leave it out; their effects are those of the domain"));
        }
        let effect = registry.own_effects.build(&table, context)?;
        if effects.iter().any(|known| known.name == effect.name) {
            let fault = Fault::at("id", format!("there is an effect `{}` already", effect.name));
            return Err(document::resolve(fault.help("give it another id"), &table));
        }
        effects.add(effect);
    }
    Ok(effects)
}
