//! The topic table: its lines, the checks on them, and the code that follows.

use crate::ends::{aliases, ends, group, members, new_ends, new_ports, ports};
use crate::input::{Error, Input, Result, once, whole_micros};
use crate::topic::{Participant, Policy, Topic, doc_or};
use proc_macro2::{Delimiter, Ident, TokenStream};
use quote::{quote, quote_spanned};

pub fn expand(table: TokenStream) -> Result<TokenStream> {
    let mut input = Input::new(table);
    let outside = outside(&mut input)?;
    let mut topics = Vec::new();
    while !input.is_empty() {
        topics.push(topic(&mut input, &outside)?);
    }
    if topics.is_empty() {
        return Err(input.error("a topic table has at least one topic"));
    }
    once(topics.iter().map(|topic| &topic.name), "topic")?;
    let participants = participants(&topics, &outside)?;
    Ok(generate(&topics, &participants))
}

/// `outside imu, tof;`
fn outside(input: &mut Input) -> Result<Vec<Ident>> {
    if !input.take_word("outside") {
        return Ok(Vec::new());
    }
    let names = input.until(';', "the participants outside, ending with `;`")?;
    let names = Input::new(names).names("a participant's name")?;
    once(names.iter(), "participant")?;
    Ok(names)
}

/// `/// What it is.` `name: Message = policy @ rate from publisher => [readers];`
fn topic(input: &mut Input, outside: &[Ident]) -> Result<Topic> {
    let attributes = input.attributes()?;
    let name = input.name("a topic's name")?;
    input.mark(':')?;
    let message = input.until('=', "a message type, then `=`")?;
    let policy = policy(input)?;
    input.mark('@')?;
    let (rate, period) = rate(input)?;
    input.word("from")?;
    let publisher = input.name("the publisher's name")?;
    input.arrow()?;
    let Some(readers) = input.group(Delimiter::Bracket) else {
        return Err(input.error("expected the readers in brackets"));
    };
    let readers = Input::new(readers.stream()).names("a reader's name")?;
    input.mark(';')?;
    once(readers.iter(), "reader")?;
    if let Some(reader) = readers.iter().find(|reader| **reader == publisher) {
        return Err(Error::new(reader.span(), format!("`{reader}` publishes this topic: it knows what it published")));
    }
    let is_runnable = |name: &Ident| !outside.contains(name);
    let within = matches!(policy, Policy::Latest) && is_runnable(&publisher) && readers.iter().any(is_runnable);
    Ok(Topic { attributes, name, message, policy, rate, period, publisher, readers, within })
}

fn policy(input: &mut Input) -> Result<Policy> {
    let expected = "expected a policy: `latest`, `ring(N)` or `queue(N)`";
    let policy = input.name("a policy: `latest`, `ring(N)` or `queue(N)`")?;
    let depth = input.group(Delimiter::Parenthesis);
    match (policy.to_string().as_str(), depth) {
        ("latest", None) => Ok(Policy::Latest),
        ("latest", Some(depth)) => {
            Err(Error::new(depth.span(), "`latest` has no depth: use `ring(N)` to keep samples"))
        }
        ("ring", Some(depth)) => Ok(Policy::Ring(depth.stream())),
        ("queue", Some(depth)) => Ok(Policy::Queue(depth.stream())),
        ("ring" | "queue", None) => Err(Error::new(policy.span(), format!("`{policy}` needs a depth: `{policy}(8)`"))),
        _ => Err(Error::new(policy.span(), expected)),
    }
}

/// `on event`, `400 Hz`, `1.6 kHz`, `1/3 Hz`.
fn rate(input: &mut Input) -> Result<(String, Option<u64>)> {
    if input.take_word("on") {
        input.word("event")?;
        return Ok(("on event".into(), None));
    }
    let mut number = input.number("a rate: `on event`, `400 Hz`, `1.6 kHz` or `1/3 Hz`")?;
    if input.take_mark('/') {
        let divisor = input.number("a number")?;
        number.value /= divisor.value;
        number.text = format!("{}/{}", number.text, divisor.text);
    }
    let (unit, factor) = if input.take_word("kHz") {
        ("kHz", 1e3)
    } else if input.take_word("Hz") {
        ("Hz", 1.0)
    } else {
        return Err(input.error("expected a unit of rate: `Hz` or `kHz`"));
    };
    let period = whole_micros(1e6 / (number.value * factor), number.at)?;
    Ok((format!("{} {unit}", number.text), Some(period)))
}

/// Everybody in the table, in the order of their first mention.
fn participants<'t>(topics: &'t [Topic], outside: &'t [Ident]) -> Result<Vec<Participant<'t>>> {
    let mut participants: Vec<Participant<'t>> = Vec::new();
    let mut place = |name: &'t Ident| -> usize {
        participants.iter().position(|participant| participant.name == name).unwrap_or_else(|| {
            let outside = outside.contains(name);
            participants.push(Participant { name, outside, publishes: Vec::new(), reads: Vec::new() });
            participants.len() - 1
        })
    };
    let mut publishes = Vec::new();
    let mut reads = Vec::new();
    for topic in topics {
        publishes.push((place(&topic.publisher), topic));
        for (number, reader) in topic.readers.iter().enumerate() {
            reads.push((place(reader), topic, number));
        }
    }
    for (participant, topic) in publishes {
        participants[participant].publishes.push(topic);
    }
    for (participant, topic, number) in reads {
        participants[participant].reads.push((topic, number));
    }
    let idle = outside.iter().find(|name| !participants.iter().any(|participant| participant.name == *name));
    match idle {
        Some(name) => Err(Error::new(name.span(), format!("`{name}` neither publishes nor reads a topic"))),
        None => Ok(participants),
    }
}

fn generate(topics: &[Topic], participants: &[Participant<'_>]) -> TokenStream {
    let table = table(topics, participants);
    let bus = bus(topics, participants);
    let ends = participants.iter().map(|participant| ends(participant));
    let ports = participants.iter().filter(|participant| !participant.outside).map(ports);
    let aliases = topics.iter().map(aliases);
    let depths = topics.iter().filter_map(depth_limits);
    let runnables = group("Ends", "The ends of every runnable.", participants, false);
    let outside = group("Outside", "The ends of everybody outside: drivers, links, motors.", participants, true);
    quote!(#table #bus #(#ends)* #(#ports)* #runnables #outside #(#aliases)* #(#depths)*)
}

/// Fails to compile, at the depth, when a ring cannot have it.
fn depth_limits(topic: &Topic) -> Option<TokenStream> {
    let (Policy::Ring(depth) | Policy::Queue(depth)) = &topic.policy else { return None };
    let at = depth.clone().into_iter().next()?.span();
    Some(quote_spanned!(at => const _: () = {
        let depth: usize = #depth;
        assert!(
            depth.is_power_of_two() && depth >= 2 && depth <= 1 << 16,
            "the depth of a topic is a power of two from 2 to 65536"
        );
    };))
}

/// Names, numbers and schemas.
fn table(topics: &[Topic], participants: &[Participant<'_>]) -> TokenStream {
    let count = topics.len();
    let names: Vec<_> = topics.iter().map(|topic| &topic.name).collect();
    let docs: Vec<_> = topics.iter().map(|topic| doc_or(&topic.attributes.doc, "A topic.")).collect();
    let rows = topics.iter().map(|topic| {
        let Topic { attributes, name, message, rate, publisher, readers, .. } = topic;
        let doc = &attributes.doc;
        let (policy, depth) = (topic.policy_name(), topic.depth());
        let period = match topic.period {
            None => quote!(None),
            Some(period) => quote!(Some(::stampfly_bus::Duration::from_micros(#period))),
        };
        let outside = participants.iter().any(|participant| participant.name == publisher && participant.outside);
        quote!(::stampfly_bus::TopicInfo {
            name: stringify!(#name),
            doc: &[#(#doc),*],
            message: <#message as ::stampfly_bus::Message>::NAME,
            policy: #policy,
            depth: #depth,
            rate: #rate,
            period: #period,
            publisher: stringify!(#publisher),
            is_outside: #outside,
            readers: &[#(stringify!(#readers)),*],
            words: <#message as ::stampfly_bus::Message>::WORDS,
            fields: <#message as ::stampfly_bus::Message>::FIELDS,
        })
    });
    quote! {
        /// A topic, by its place in the table.
        #[allow(non_camel_case_types, reason = "a topic has one spelling everywhere")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Id { #(#docs #names),* }

        impl Id {
            /// Every topic, in the table's order.
            pub const ALL: [Self; COUNT] = [#(Self::#names),*];

            /// What the table says of it.
            #[must_use]
            pub const fn info(self) -> &'static ::stampfly_bus::TopicInfo {
                &TOPICS[self as usize]
            }
        }

        /// Number of topics.
        pub const COUNT: usize = #count;

        /// The table itself.
        pub static TOPICS: [::stampfly_bus::TopicInfo; COUNT] = [#(#rows),*];
    }
}

/// The storage, and how it is split.
fn bus(topics: &[Topic], participants: &[Participant<'_>]) -> TokenStream {
    let names: Vec<_> = topics.iter().map(|topic| &topic.name).collect();
    let storage = topics.iter().map(|topic| {
        let (message, policy, depth, words, required) =
            (&topic.message, topic.policy_type(), topic.depth(), topic.words(), topic.required());
        quote!(::stampfly_bus::Topic<#message, #policy, { #depth }, #words, #required>)
    });
    let taps = topics.iter().map(|topic| {
        let (message, depth, words) = (&topic.message, topic.depth(), topic.words());
        quote!(::stampfly_bus::Tap<'b, #message, { #depth }, #words>)
    });
    let (runnables, outside): (Vec<_>, Vec<_>) = participants.iter().partition(|participant| !participant.outside);
    let runnables = members(runnables.iter().map(|participant| new_ports(participant)));
    let outside = members(outside.iter().map(|participant| new_ends(participant)));
    quote! {
        /// Storage of every topic of one vehicle.
        pub struct Bus { #(#names: #storage),* }

        impl Bus {
            /// A bus on which nothing has been published. `const`: firmware keeps it in a static.
            #[must_use]
            #[allow(clippy::new_without_default, reason = "`Default` cannot be `const`")]
            pub const fn new() -> Self {
                Self { #(#names: ::stampfly_bus::Topic::new()),* }
            }

            /// Hands out every end once. `hook` is called after every publish.
            #[inline(always)]
            pub fn split(&mut self, hook: Option<::stampfly_bus::Hook>) -> ::stampfly_bus::Split<'_, Self> {
                let bus: &Self = self;
                ::stampfly_bus::Split {
                    runnables: Ends { #runnables },
                    outside: Outside { #outside },
                    taps: Taps { #(#names: ::stampfly_bus::Tap::__new(&bus.#names)),* },
                    heads: [#(&bus.#names as &dyn ::stampfly_bus::AnyTopic),*],
                }
            }
        }

        impl ::stampfly_bus::TopicTable for Bus {
            const TOPICS: &'static [::stampfly_bus::TopicInfo] = &TOPICS;
            type Ends<'b> = Ends<'b>;
            type Outside<'b> = Outside<'b>;
            type Taps<'b> = Taps<'b>;
            type Heads<'b> = [&'b dyn ::stampfly_bus::AnyTopic; COUNT];

            fn new() -> Self {
                Self::new()
            }

            #[inline(always)]
            fn split(&mut self, hook: Option<::stampfly_bus::Hook>) -> ::stampfly_bus::Split<'_, Self> {
                Self::split(self, hook)
            }
        }

        /// The log's cursors: every sample of every topic.
        pub struct Taps<'b> { #(#names: #taps),* }

        impl ::stampfly_bus::Taps for Taps<'_> {
            fn drain(&mut self, take: &mut dyn FnMut(usize, ::stampfly_bus::Instant, u32, &[u32])) {
                #(self.#names.drain(&mut |at, generation, words| take(Id::#names as usize, at, generation, words));)*
            }

            fn lost(&self) -> u32 {
                0 #(+ self.#names.lost())*
            }
        }
    }
}
