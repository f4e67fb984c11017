//! The ends of the participants. Whoever is outside has its ends once and for all. A runnable's are made for each activation, out of
//! ports that know what has to be known at the next one: so they may refer to what another runnable keeps.

use crate::input::type_name;
use crate::topic::{Participant, Policy, Topic, doc_or};
use proc_macro2::TokenStream;
use quote::{format_ident, quote, quote_spanned};

/// The fields of a group, which may be empty.
pub fn members(made: impl Iterator<Item = TokenStream>) -> TokenStream {
    let made: Vec<_> = made.collect();
    if made.is_empty() { quote!(nobody: ::core::marker::PhantomData) } else { quote!(#(#made,)*) }
}

/// The ends of somebody outside, made once.
pub fn new_ends(participant: &Participant<'_>) -> TokenStream {
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
pub fn new_ports(participant: &Participant<'_>) -> TokenStream {
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

/// The ends of one participant.
pub fn ends(participant: &Participant<'_>) -> TokenStream {
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
pub fn ports(participant: &Participant<'_>) -> TokenStream {
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
pub fn group(name: &str, doc: &str, participants: &[Participant<'_>], outside: bool) -> TokenStream {
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
pub fn aliases(topic: &Topic) -> TokenStream {
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
