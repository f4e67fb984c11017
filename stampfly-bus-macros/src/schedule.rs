//! The activation table: its lines, the checks on them, and the code that follows.

use crate::input::{Attributes, Error, Input, Result, located, once};
use proc_macro2::{Ident, Span, TokenStream, TokenTree};
use quote::{format_ident, quote, quote_spanned};

enum Trigger {
    On(Vec<Ident>),
    Every(u64),
    After(Ident),
}

/// One line of the table.
struct Row {
    attributes: Attributes,
    name: Ident,
    runnable: TokenStream,
    trigger: Trigger,
    at_latest: Option<u64>,
    band: Ident,
    budget: u64,
}

/// The first line: the struct to generate, the topic table and the configuration.
struct Head {
    attributes: TokenStream,
    visibility: TokenStream,
    name: Ident,
    topics: TokenStream,
    config: TokenStream,
}

/// As many topics as one `on` can name; `stampfly_bus::MAX_TRIGGERS`.
const MAX_TRIGGERS: usize = 4;

pub fn expand(table: TokenStream) -> Result<TokenStream> {
    let mut input = Input::new(table);
    let head = head(&mut input)?;
    let mut rows = Vec::new();
    while !input.is_empty() {
        rows.push(row(&mut input, &rows)?);
    }
    if rows.is_empty() {
        return Err(input.error("an activation table has at least one line"));
    }
    once(rows.iter().map(|row| &row.name), "runnable")?;
    Ok(generate(&head, &rows))
}

/// `pub struct Runnables on crate::topics from Config;`
fn head(input: &mut Input) -> Result<Head> {
    let attributes = input.attributes()?.all;
    let mut visibility = TokenStream::new();
    if input.is_word("pub") {
        visibility.extend(input.next());
        visibility.extend(input.group(proc_macro2::Delimiter::Parenthesis).map(TokenTree::Group));
    }
    let expected = "expected `struct Runnables on path::to::topics from Config;`";
    if !input.take_word("struct") {
        return Err(input.error(expected));
    }
    let name = input.name("a name for the struct of all runnables")?;
    if !input.take_word("on") {
        return Err(input.error(expected));
    }
    let mut line = Input::new(input.until(';', "`;`")?);
    let mut topics = TokenStream::new();
    while !line.is_word("from") {
        match line.next() {
            Some(token) => topics.extend([token]),
            None => return Err(line.error("expected `from` and the type runnables are configured from")),
        }
    }
    line.word("from")?;
    let mut config = TokenStream::new();
    while let Some(token) = line.next() {
        config.extend([token]);
    }
    if topics.is_empty() || config.is_empty() {
        return Err(line.error(expected));
    }
    Ok(Head { attributes, visibility, name, topics, config })
}

/// `name = Runnable: trigger [or at latest 5 ms], band, 300 us;`
fn row(input: &mut Input, above: &[Row]) -> Result<Row> {
    let attributes = input.attributes()?;
    let name = input.name("a runnable's name")?;
    input.mark('=')?;
    let runnable = input.until(':', "the runnable's type, then `:`")?;
    let trigger = trigger(input, above)?;
    let mut at_latest = None;
    if input.is_word("or") {
        let at = input.error("`every` is its own deadline");
        input.word("or")?;
        input.word("at")?;
        input.word("latest")?;
        at_latest = Some(input.time("a time, such as `5 ms`")?);
        if matches!(trigger, Trigger::Every(_)) {
            return Err(at);
        }
    }
    input.mark(',')?;
    let band = input.name("a band: `flight` or `background`")?;
    if band != "flight" && band != "background" {
        return Err(Error::new(band.span(), "expected a band: `flight` or `background`"));
    }
    input.mark(',')?;
    let budget = input.time("a budget, such as `300 us`")?;
    input.mark(';')?;
    Ok(Row { attributes, name, runnable, trigger, at_latest, band, budget })
}

fn trigger(input: &mut Input, above: &[Row]) -> Result<Trigger> {
    if input.take_word("on") {
        let mut topics = vec![input.name("a topic's name")?];
        while input.take_mark('|') {
            topics.push(input.name("a topic's name")?);
        }
        return match topics.get(MAX_TRIGGERS) {
            Some(one_too_many) => {
                Err(Error::new(one_too_many.span(), format!("`on` names at most {MAX_TRIGGERS} topics")))
            }
            None => Ok(Trigger::On(topics)),
        };
    }
    if input.take_word("every") {
        return Ok(Trigger::Every(input.time("a period, such as `20 ms`")?));
    }
    if input.take_word("after") {
        let before = input.name("a runnable's name")?;
        if !above.iter().any(|row| row.name == before) {
            return Err(Error::new(
                before.span(),
                "`after` names a line above: the flight band runs in the table's order",
            ));
        }
        return Ok(Trigger::After(before));
    }
    Err(input.error("expected a trigger: `on topic`, `every 20 ms` or `after runnable`"))
}

impl Row {
    fn info(&self, topics: &TokenStream) -> TokenStream {
        let Self { attributes, name, trigger, at_latest, band, budget, .. } = self;
        let doc = &attributes.doc;
        let micros = |micros: &u64| quote!(::stampfly_bus::Duration::from_micros(#micros));
        let trigger = match trigger {
            Trigger::On(on) => quote!(::stampfly_bus::Trigger::On(&[#(#topics::Id::#on as usize),*])),
            Trigger::Every(period) => {
                let period = micros(period);
                quote!(::stampfly_bus::Trigger::Every(#period))
            }
            Trigger::After(before) => quote!(::stampfly_bus::Trigger::After(Id::#before as usize)),
        };
        let at_latest = at_latest.as_ref().map_or_else(
            || quote!(None),
            |time| {
                let time = micros(time);
                quote!(Some(#time))
            },
        );
        let band = if band == "flight" { quote!(Flight) } else { quote!(Background) };
        let budget = micros(budget);
        quote!(::stampfly_bus::ActivationInfo {
            name: stringify!(#name),
            doc: &[#(#doc),*],
            trigger: #trigger,
            at_latest: #at_latest,
            band: ::stampfly_bus::Band::#band,
            budget: #budget,
        })
    }

    fn doc(&self) -> TokenStream {
        let doc = &self.attributes.doc;
        if doc.is_empty() { quote!(#[doc = "A runnable."]) } else { quote!(#(#[doc = #doc])*) }
    }

    /// Fails to compile, at this line, when it may be late.
    fn in_time(&self) -> TokenStream {
        let name = &self.name;
        let no_rate = format!("`{name}` is activated by a topic without a rate");
        let late = format!("`{name}` may not have finished when it is due again");
        quote_spanned!(located(name) => const _: () = match RESPONSES[Id::#name as usize] {
            Ok(_) => {}
            Err(::stampfly_bus::Unbounded::NoRate) => panic!(#no_rate),
            Err(_) => panic!(#late),
        };)
    }
}

fn generate(head: &Head, rows: &[Row]) -> TokenStream {
    let Head { attributes, visibility, name: all, topics, config } = head;
    let count = rows.len();
    let names: Vec<_> = rows.iter().map(|row| &row.name).collect();
    let types: Vec<_> = rows.iter().map(|row| &row.runnable).collect();
    let docs: Vec<_> = rows.iter().map(Row::doc).collect();
    let infos = rows.iter().map(|row| row.info(topics));
    let in_time = rows.iter().map(Row::in_time);
    // One place for each, so that a wrong constructor is reported once.
    let makers: Vec<_> = names.iter().map(|name| format_ident!("__new_{name}")).collect();
    let make = rows.iter().zip(&makers).map(|(row, maker)| {
        let (name, runnable) = (&row.name, &row.runnable);
        quote_spanned!(located(name) => #[inline(always)] fn #maker(config: &#config) -> #runnable { <#runnable>::new(config) })
    });
    let places: Vec<_> = names.iter().map(|name| quote!(index if index == Id::#name as usize)).collect();
    let reads = names.iter().map(|name| {
        quote_spanned!(located(name) => {
            if activation.__looks() {
                ends.#name().__look(activation);
            } else {
                ::stampfly_bus::ReadInputs::read(&mut ends.#name(), activation);
            }
        })
    });
    let runs = rows.iter().map(|row| {
        let (name, runnable) = (&row.name, &row.runnable);
        // At the line's own name, so that a runnable with the ends of another is reported there.
        quote_spanned!(located(name) =>
            ::stampfly_bus::__run::<#runnable, _>(&mut self.#name, activation, ends, |ends| ends.#name()))
    });
    let inputs = rows.iter().map(|row| {
        let runnable = &row.runnable;
        quote!(<<#runnable as ::stampfly_bus::Runnable>::Ends<'static> as ::stampfly_bus::ReadInputs>::INPUTS)
    });
    let all_lines = all_lines(topics, &names);
    quote! {
        /// A runnable, by its line in the table.
        #[allow(non_camel_case_types, reason = "a runnable has one spelling everywhere")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Id { #(#docs #names),* }

        /// Number of runnables.
        pub const COUNT: usize = #count;

        const TABLE: [::stampfly_bus::ActivationInfo; COUNT] = [#(#infos),*];

        /// The table itself.
        pub static ACTIVATIONS: [::stampfly_bus::ActivationInfo; COUNT] = TABLE;

        const RESPONSES: [Result<::stampfly_bus::Duration, ::stampfly_bus::Unbounded>; COUNT] = {
            let mut responses = [Err(::stampfly_bus::Unbounded::NoRate); COUNT];
            let mut index = 0;
            while index < COUNT {
                responses[index] = ::stampfly_bus::response_time(&TABLE, &#topics::TOPICS, index);
                index += 1;
            }
            responses
        };
        #(#in_time)*

        /// How long after its trigger each runnable has published at the latest, if all keep their budgets.
        pub const RESPONSE_TIMES: [::stampfly_bus::Duration; COUNT] = {
            let mut times = [::stampfly_bus::Duration::ZERO; COUNT];
            let mut index = 0;
            while index < COUNT {
                if let Ok(time) = RESPONSES[index] {
                    times[index] = time;
                }
                index += 1;
            }
            times
        };

        #attributes
        #visibility struct #all { #(#docs pub #names: #types),* }

        impl #all {
            /// Every runnable at power-on.
            #[must_use]
            pub fn new(config: &#config) -> Self {
                Self { #(#names: Self::#makers(config)),* }
            }

            #(#make)*
        }

        impl ::stampfly_bus::Schedule for #all {
            type Topics = #topics::Bus;
            type Config = #config;
            type States = [::stampfly_bus::ActivationState; COUNT];
            const ACTIVATIONS: &'static [::stampfly_bus::ActivationInfo] = &ACTIVATIONS;
            const INPUTS: &'static [usize] = &[#(#inputs),*];

            fn new(config: &#config) -> Self {
                Self::new(config)
            }

            #[inline(always)]
            fn renew(&mut self, index: usize, config: &#config) {
                match index {
                    #(#places => self.#names = Self::#makers(config),)*
                    _ => {}
                }
            }

            fn states(start: ::stampfly_bus::Instant) -> Self::States {
                [::stampfly_bus::ActivationState::new(start); COUNT]
            }

            #[inline(always)]
            fn visit<V: ::stampfly_bus::VisitLines>(visitor: &mut V) {
                #(visitor.line::<{ Id::#names as usize }>();)*
            }

            // Where the line is known while compiling, this is its own reading alone.
            #[inline(always)]
            fn read(
                ends: &mut <Self::Topics as ::stampfly_bus::TopicTable>::Ends<'_>,
                index: usize,
                activation: &mut ::stampfly_bus::Activation,
            ) {
                match index {
                    #(#places => #reads,)*
                    _ => {}
                }
            }

            #[inline(always)]
            fn run(
                &mut self,
                ends: &mut <Self::Topics as ::stampfly_bus::TopicTable>::Ends<'_>,
                index: usize,
                activation: &mut ::stampfly_bus::Activation,
            ) {
                match index {
                    #(#places => #runs,)*
                    _ => {}
                }
            }
        }

        #all_lines
    }
}

/// Fails to compile, at the name of the topic table, when a participant that is not outside has no line.
fn all_lines(topics: &TokenStream, names: &[&Ident]) -> TokenStream {
    let at = topics.clone().into_iter().last().map_or_else(Span::call_site, |token| token.span());
    quote_spanned!(at => const _: fn(#topics::Ends<'_>) = |ends| {
        let #topics::Ends { #(#names: _),* } = ends;
    };)
}
