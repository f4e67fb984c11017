//! The topic table: its lines, the checks on them, and the code that follows.

use crate::input::{Attributes, Error, Input, Result, once, type_name, whole_micros};
use proc_macro2::{Delimiter, Ident, Literal, Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};

/// How a topic keeps its samples.
enum Policy {
    Latest,
    Ring(TokenStream),
    Queue(TokenStream),
}

/// One line of the table.
struct Topic {
    attributes: Attributes,
    name: Ident,
    message: TokenStream,
    policy: Policy,
    /// As written, for people.
    rate: String,
    /// Microseconds between two samples; `None` when they come on events.
    period: Option<u64>,
    publisher: Ident,
    readers: Vec<Ident>,
    /// Is it the newest sample of a runnable for other runnables?
    within: bool,
}

/// Somebody who publishes or reads.
struct Participant<'t> {
    name: &'t Ident,
    outside: bool,
    publishes: Vec<&'t Topic>,
    /// The topic, and which of its readers this one is.
    reads: Vec<(&'t Topic, usize)>,
}

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

fn doc_or(doc: &[Literal], otherwise: &str) -> TokenStream {
    if doc.is_empty() { quote!(#[doc = #otherwise]) } else { quote!(#(#[doc = #doc])*) }
}

impl Topic {
    fn policy_type(&self) -> TokenStream {
        match self.policy {
            Policy::Latest => quote!(::stampfly_bus::Latest),
            Policy::Ring(_) => quote!(::stampfly_bus::Every),
            Policy::Queue(_) => quote!(::stampfly_bus::Lossless),
        }
    }

    fn policy_name(&self) -> &'static str {
        match self.policy {
            Policy::Latest => "latest",
            Policy::Ring(_) => "ring",
            Policy::Queue(_) => "queue",
        }
    }

    fn depth(&self) -> TokenStream {
        match &self.policy {
            Policy::Latest => quote!(::stampfly_bus::LATEST_DEPTH),
            Policy::Ring(depth) | Policy::Queue(depth) => depth.clone(),
        }
    }

    /// Readers whose cursors the publisher must respect.
    fn required(&self) -> usize {
        if matches!(self.policy, Policy::Queue(_)) { self.readers.len() } else { 0 }
    }

    /// The message, at its own place in the source: what is wrong with it is reported there.
    fn words(&self) -> TokenStream {
        let message = &self.message;
        let at = message.clone().into_iter().next().map_or_else(Span::call_site, |token| token.span());
        quote_spanned!(at => { <#message as ::stampfly_bus::Message>::WORDS })
    }

    fn publisher_type(&self) -> TokenStream {
        let (message, policy, depth, words, required) =
            (&self.message, self.policy_type(), self.depth(), self.words(), self.required());
        if self.within {
            return quote!(::stampfly_bus::NewestOutput<'b, #message, { #depth }, #words>);
        }
        quote!(::stampfly_bus::Publisher<'b, #message, #policy, { #depth }, #words, #required>)
    }

    fn subscriber_type(&self) -> TokenStream {
        let (message, policy, depth, words) = (&self.message, self.policy_type(), self.depth(), self.words());
        quote!(::stampfly_bus::Subscriber<'b, #message, #policy, { #depth }, #words>)
    }

    /// What a runnable reads from: the newest sample, or every one since its last activation.
    fn input_type(&self) -> TokenStream {
        let (message, policy, depth, words) = (&self.message, self.policy_type(), self.depth(), self.words());
        match self.policy {
            Policy::Latest => quote!(::stampfly_bus::NewestInput<'b, #message, { #depth }, #words>),
            Policy::Ring(_) | Policy::Queue(_) => {
                quote!(::stampfly_bus::SamplesInput<'b, #message, #policy, { #depth }, #words>)
            }
        }
    }
}

impl Participant<'_> {
    fn ends(&self) -> Ident {
        type_name(self.name, "Ends")
    }

    /// What its ends know from one activation to the next; whoever is outside keeps its ends.
    fn ports(&self) -> Ident {
        type_name(self.name, "Ports")
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

/// The fields of a group, which may be empty.
fn members(made: impl Iterator<Item = TokenStream>) -> TokenStream {
    let made: Vec<_> = made.collect();
    if made.is_empty() { quote!(nobody: ::core::marker::PhantomData) } else { quote!(#(#made,)*) }
}

/// The ends of somebody outside, made once.
fn new_ends(participant: &Participant<'_>) -> TokenStream {
    let (name, ends) = (participant.name, participant.ends());
    let publishes = participant.publishes.iter().map(|topic| {
        let name = &topic.name;
        quote!(#name: bus.#name.__publisher(hook, Id::#name as usize))
    });
    let reads = participant.reads.iter().map(|(topic, number)| {
        let name = &topic.name;
        quote!(#name: bus.#name.__subscriber(#number))
    });
    quote!(#name: #ends { #(#publishes,)* #(#reads,)* })
}

/// What a runnable's ends know before the first activation.
fn new_ports(participant: &Participant<'_>) -> TokenStream {
    let (name, ports) = (participant.name, participant.ports());
    let hook = (!participant.publishes.is_empty()).then(|| quote!(hook,));
    let kept = participant.publishes.iter().filter(|topic| topic.within).map(|topic| {
        let name = &topic.name;
        quote!(#name: ::stampfly_bus::NewestOutput::__place(&bus.#name))
    });
    let reads = participant.reads.iter().map(|(topic, number)| {
        let name = &topic.name;
        match &topic.policy {
            Policy::Latest => quote!(#name: ::stampfly_bus::NewestPort::__new()),
            _ => quote!(#name: ::stampfly_bus::SamplesPort::__new(&bus.#name, #number)),
        }
    });
    quote!(#name: #ports { bus, #hook #(#kept,)* #(#reads,)* })
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

/// The ends of one participant.
fn ends(participant: &Participant<'_>) -> TokenStream {
    let Participant { name, outside, publishes, reads } = participant;
    let ends = participant.ends();
    let doc = format!("The ends of `{name}`.");
    let publishers = publishes.iter().map(|topic| {
        let (name, publisher) = (&topic.name, topic.publisher_type());
        let doc = doc_or(&topic.attributes.doc, "A topic.");
        quote!(#doc pub #name: #publisher)
    });
    let readers = reads.iter().map(|(topic, _)| {
        let (name, reader) = (&topic.name, if *outside { topic.subscriber_type() } else { topic.input_type() });
        let doc = doc_or(&topic.attributes.doc, "A topic.");
        quote!(#doc pub #name: #reader)
    });
    let definition = quote! {
        #[doc = #doc]
        pub struct #ends<'b> { #(#publishers,)* #(#readers,)* }
    };
    if *outside {
        return definition;
    }
    let inputs: Vec<_> = reads.iter().map(|(topic, _)| &topic.name).collect();
    let (count, message) = (reads.len(), format!("`{name}` reads too many topics"));
    let at = name.span();
    let limit = quote_spanned!(at => const _: () = assert!(#count <= ::stampfly_bus::MAX_INPUTS, #message););
    quote! {
        #definition
        #limit

        impl #ends<'_> {
            #[doc(hidden)]
            #[inline(always)]
            #[allow(dead_code, reason = "a program may run some of its runnables only")]
            pub fn __look(&mut self, activation: &mut ::stampfly_bus::Activation) {
                if let Some([#(#inputs),*]) = activation.__places() {
                    #(*#inputs = self.#inputs.__look();)*
                }
            }
        }

        impl ::stampfly_bus::ReadInputs for #ends<'_> {
            const INPUTS: usize = #count;

            #[inline]
            fn read(&mut self, activation: &mut ::stampfly_bus::Activation) {
                let _ = &activation;
                #(self.#inputs.read(activation);)*
            }
        }
    }
}

/// What the ends of a runnable know from one activation to the next.
fn ports(participant: &Participant<'_>) -> TokenStream {
    let (name, ports) = (participant.name, participant.ports());
    let doc = format!("What the ends of `{name}` know from one activation to the next.");
    let hook = (!participant.publishes.is_empty()).then(|| quote!(hook: Option<::stampfly_bus::Hook>,));
    let kept = participant.publishes.iter().filter(|topic| topic.within).map(|topic| {
        let (name, message) = (&topic.name, &topic.message);
        quote!(#name: ::stampfly_bus::Stamped<#message>)
    });
    let reads = participant.reads.iter().map(|(topic, _)| {
        let (name, message, depth) = (&topic.name, &topic.message, topic.depth());
        match topic.policy {
            Policy::Latest => quote!(#name: ::stampfly_bus::NewestPort<#message>),
            _ => quote!(#name: ::stampfly_bus::SamplesPort<#message, { #depth }>),
        }
    });
    quote! {
        #[doc = #doc]
        pub struct #ports<'b> { bus: &'b Bus, #hook #(#kept,)* #(#reads,)* }
    }
}

/// How the ends of a runnable are made for an activation.
fn lent_ends(participant: &Participant<'_>) -> TokenStream {
    let (name, ends) = (participant.name, participant.ends());
    let doc = format!("The ends of `{name}`, for one activation.");
    let publishes = participant.publishes.iter().map(|topic| {
        let name = &topic.name;
        let publisher = quote!(ports.bus.#name.__publisher(ports.hook, Id::#name as usize));
        match topic.within {
            true => quote!(#name: ::stampfly_bus::NewestOutput::__new(#publisher, &mut ports.#name)),
            false => quote!(#name: #publisher),
        }
    });
    let reads = participant.reads.iter().map(|(topic, number)| {
        let (name, publisher) = (&topic.name, &topic.publisher);
        let topic_and_port = quote!(&ports.bus.#name);
        match (&topic.policy, topic.within) {
            (Policy::Latest, true) => quote!(#name: ::stampfly_bus::NewestInput::__new(
                #topic_and_port, &mut ports.#name, Some(&self.#publisher.#name))),
            (Policy::Latest, false) => {
                quote!(#name: ::stampfly_bus::NewestInput::__new(#topic_and_port, &mut ports.#name, None))
            }
            _ => quote!(#name: ::stampfly_bus::SamplesInput::__new(#topic_and_port, #number, &mut ports.#name)),
        }
    });
    quote! {
        #[doc = #doc]
        #[inline(always)]
        pub fn #name(&mut self) -> #ends<'_> {
            let ports = &mut self.#name;
            #ends { #(#publishes,)* #(#reads,)* }
        }
    }
}

/// The ends of several participants.
fn group(name: &str, doc: &str, participants: &[Participant<'_>], outside: bool) -> TokenStream {
    let group = format_ident!("{name}");
    let members: Vec<_> = participants.iter().filter(|participant| participant.outside == outside).collect();
    let names: Vec<_> = members.iter().map(|participant| participant.name).collect();
    let types = members.iter().map(|participant| if outside { participant.ends() } else { participant.ports() });
    let docs = names.iter().map(|name| match outside {
        true => format!("The ends of `{name}`."),
        false => format!("What the ends of `{name}` know."),
    });
    let publishers = members.iter().flat_map(|participant| {
        participant.publishes.iter().map(|topic| {
            let (participant, topic) = (participant.name, &topic.name);
            let ends = if outside { quote!(self.#participant) } else { quote!(self.#participant()) };
            (quote!(topic if topic == Id::#topic as usize), quote!(#ends.#topic))
        })
    });
    let (places, publishers): (Vec<_>, Vec<_>) = publishers.unzip();
    let lent = (!outside).then(|| {
        let ends = members.iter().map(|participant| lent_ends(participant));
        quote! {
            #[allow(dead_code, reason = "a program may run some of its runnables only")]
            impl #group<'_> { #(#ends)* }
        }
    });
    // A group may be empty; it has the bus's lifetime all the same.
    let nobody = members.is_empty().then(|| quote!(nobody: ::core::marker::PhantomData<&'b ()>));
    quote! {
        #[doc = #doc]
        pub struct #group<'b> {
            #(#[doc = #docs] pub #names: #types<'b>,)*
            #nobody
        }

        #lent

        impl ::stampfly_bus::PublishWords for #group<'_> {
            fn publish_words(&mut self, topic: usize, at: ::stampfly_bus::Instant, words: &[u32]) -> Option<u32> {
                let _ = (at, words);
                match topic {
                    #(#places => #publishers.publish_words(at, words),)*
                    _ => None,
                }
            }

            fn restore_words(
                &mut self,
                topic: usize,
                at: ::stampfly_bus::Instant,
                generation: u32,
                words: &[u32],
            ) -> Option<()> {
                let _ = (at, generation, words);
                match topic {
                    #(#places => #publishers.restore_words(at, generation, words),)*
                    _ => None,
                }
            }
        }
    }
}

/// Names for the types of a topic's ends, for those who store one.
fn aliases(topic: &Topic) -> TokenStream {
    let (tx, rx) = (type_name(&topic.name, "Tx"), type_name(&topic.name, "Rx"));
    let (publisher, subscriber) = (topic.publisher_type(), topic.subscriber_type());
    let name = &topic.name;
    let docs = [format!("The writing end of `{name}`."), format!("A reading end of `{name}`, outside the runnables.")];
    let [of_tx, of_rx] = docs;
    quote! {
        #[doc = #of_tx]
        pub type #tx<'b> = #publisher;
        #[doc = #of_rx]
        pub type #rx<'b> = #subscriber;
    }
}
